#!/bin/sh
# One night: the newest export of a folder into the store, then the pages, then old nights away.
# usage: night.sh PLANT        PLANT holds exports/, loops.csv, and changes.csv if settings are written down there
# exit status: that of `triage run` (0 the night is there, 1 some loops failed, 2 nothing could be done)
set -u
PLANT=${1:?usage: night.sh PLANT}
TRIAGE=${TRIAGE:-triage}
JOBS=${JOBS:-2}
ZONE=${ZONE:-UTC}
cd "$PLANT" || exit 2

EXPORT=$(ls -t exports | head -n 1)
[ -n "$EXPORT" ] || { echo "night.sh: no export in $PLANT/exports" >&2; exit 2; }
set -- "exports/$EXPORT" --loops loops.csv --timezone "$ZONE" --store store --jobs "$JOBS" --log triage.log
[ -f changes.csv ] && set -- "$@" --changes changes.csv

$TRIAGE run "$@" 2>>triage.err
STATUS=$?
# killed by the system or stopped by a signal: what was done is kept, so one more try goes on from there
if [ "$STATUS" -gt 2 ]; then
    $TRIAGE run "$@" --resume 2>>triage.err
    STATUS=$?
fi
# pages are made whatever became of tonight: yesterday's night is still worth reading
$TRIAGE pages store --out pages >/dev/null 2>>triage.err
$TRIAGE store prune store --keep 400d --keep-trends 90d >/dev/null 2>>triage.err
exit "$STATUS"
