"""Which contact law recordings require, with which values, and how sure each is."""
