"""What the nights of a store together say of each loop: Findings of many nights in, beliefs out."""
