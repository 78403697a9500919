"""Proofs that are commands of their own; a fixed share of each runs as a test."""
