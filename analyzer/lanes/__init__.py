"""Why a loop is worth a look: one object a lane."""
