"""Which contact law recordings require, with which values, and how sure each is.

what was measured -> an observation --infer--> Posterior --climb--> Ladder --compare--> Comparison
"""
