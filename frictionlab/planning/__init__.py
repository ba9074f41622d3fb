"""The next tests planned: what each candidate would show of a law, and which ones together show most.

scene --laboratory--> Candidate --virtual_test--> what a fit of it would state --plan_tests--> Plan
"""
