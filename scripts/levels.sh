#!/usr/bin/env bash
# Levels beside the reference: the tables of docs/results.md, on the portal files of $ENFILADE_DATA. Prints them as Markdown and
# leaves rows, pages and JSON in out/levels. RAYS=100000000 tests the rows with so many random lines, too (an hour or so).
set -euo pipefail
cd "$(dirname "$0")/.."
data=${ENFILADE_DATA:-../shared/data}
rays=${RAYS:-0}
threads=${THREADS:-1}
out=out/levels
levels=("$@")
[ $# -gt 0 ] || levels=(lqdm12 id_dm4 lq_e0m1 lqdm13 id_e1m3 lq_e0m3 lq_e0m2)
cargo build --release --features quake
mkdir -p "$out"

# The first number with a key in a file, from `"against"` on with a third argument.
number() { sed -n "/\"${3:-}/,\$ s/^ *\"$2\": \([0-9.]*\),\{0,1\}\$/\1/p" "$1" | head -n 1; }

TIMEFORMAT='%U'
echo "| level | clusters | portals | reference's pairs | ours | of ours undecided | refuted of the reference's | lost by it | one way only | CPU s |"
echo "| --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |"
for level in "${levels[@]}"; do
  prt=$data/prt/$level.prt
  theirs=$out/$level.reference.txt json=$out/$level.json
  gzip -dc "$data/prt/$level.vis.txt.gz" >"$theirs"
  { time ./target/release/enfilade vis "$prt" --against "$theirs" --rows "$out/$level.rows.txt" --state "$out/$level.state" \
    --threads "$threads" --json >"$json" 2>"$out/$level.log"; } 2>"$out/$level.seconds"
  echo "| $level | $(number "$json" clusters) | $(number "$json" portals) | $(number "$json" their_pairs) | $(number "$json" upper_pairs)" \
    "| $(number "$json" undecided_pairs) | $(number "$json" refuted_pairs) | $(number "$json" lost_pairs)" \
    "| $(number "$json" one_way_pairs), $(number "$json" one_way_refuted_pairs) refuted | $(cat "$out/$level.seconds") |"
done

echo
echo "Both bounds against time:"
for level in "${levels[@]}"; do
  ./target/release/enfilade report "$data/prt/$level.prt" --rows "$out/$level.reference.txt" -o "$out/$level.html" \
    --threads "$threads" 2>"$out/$level.report.log"
  echo
  cat "$out/$level.csv"
done

[ "$rays" = 0 ] && exit
echo
echo "| level | lines | portals passed | missed pairs | s |"
echo "| --- | --- | --- | --- | --- |"
failed=0
for level in "${levels[@]}"; do
  ./target/release/enfilade check "$data/prt/$level.prt" --rows "$out/$level.rows.txt" --rays "$rays" --threads "$threads" --json \
    2>/dev/null | tr ',' '\n' | sed 's/[{}]//g; s/^"\([a-z_]*\)":/  "\1": /' >"$out/$level.check" || failed=1
  echo "| $level | $(number "$out/$level.check" rays) | $(number "$out/$level.check" crossings) |" \
    "$(number "$out/$level.check" missed_pairs) | $(number "$out/$level.check" seconds) |"
done
exit $failed
