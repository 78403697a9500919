"""Why a loop is worth a look beside its oscillation."""
