"""Proofs. Each proof is a command; the test suite runs a fixed share of each."""
