"""Joint results of the nights of a store for each loop: Findings of many nights in, beliefs out."""
