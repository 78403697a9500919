#!/bin/sh
# One night: the newest export of a folder into the store, then the pages, then old nights away.
# usage: night.sh PLANT        PLANT holds exports/, loops.csv, and changes.csv if settings are written down there
# exit status: that of `triage run` (0 the night is there, 1 some loops failed, 2 nothing could be done, 75 shared
# storage failed for too long), 70 where triage did not even start
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

LOGGED=$(wc -c 2>/dev/null <triage.log || echo 0)
$TRIAGE run "$@" >/dev/null 2>>triage.err
STATUS=$?
# killed, stopped by a signal, or a storage that failed for a while: what was done is kept, so one more try goes on
if [ "$STATUS" -gt 2 ]; then
    [ "$STATUS" -eq 75 ] && sleep "${AGAIN_S:-600}"
    $TRIAGE run "$@" --resume >/dev/null 2>>triage.err
    STATUS=$?
fi
# a Python that cannot start ends with 1, too: it is a night only where the log of this night says so
if [ "$STATUS" -eq 1 ]; then
    [ "$(wc -c 2>/dev/null <triage.log || echo 0)" -ge "$LOGGED" ] || LOGGED=0
    tail -c +$((LOGGED + 1)) triage.log 2>/dev/null | grep -q ' end status=1 ' || STATUS=70
fi
# pages are made whatever became of tonight: yesterday's night is still worth reading
$TRIAGE pages store --out pages >/dev/null 2>>triage.err
$TRIAGE store prune store --keep 400d --keep-trends 90d >/dev/null 2>>triage.err
exit "$STATUS"
