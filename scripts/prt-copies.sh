#!/usr/bin/env bash
# Copies of a portal file side by side, 16,384 units apart, as PRT1 to stdout: `bash scripts/prt-copies.sh LEVEL.prt COPIES [DECIMALS]`.
# With DECIMALS, coordinates are rounded to so many. Cells are the clusters of a PRT2.
set -euo pipefail
awk -v copies="${2:-1}" -v decimals="${3:-}" '
  NR == 1 { header = $1 == "PRT2" ? 4 : 3 }
  NR == header - 1 { cells = $1 }
  NR == header { portals = $1 }
  NR > header && NR <= header + portals { line[NR - header] = $0 }
  function number(x) { return decimals == "" ? sprintf("%.17g", x) : sprintf("%." decimals "f", x) }
  END {
    print "PRT1\n" cells * copies "\n" portals * copies
    for (copy = 0; copy < copies; copy++) for (i = 1; i <= portals; i++) {
      corners = split(line[i], part, "(")
      split(part[1], head, " ")
      text = head[1] " " head[2] + copy * cells " " head[3] + copy * cells
      for (k = 2; k <= corners; k++) {
        gsub(/\)/, "", part[k])
        split(part[k], p, " ")
        text = text " (" number(p[1] + copy * 16384) " " number(p[2]) " " number(p[3]) ")"
      }
      print text
    }
  }' "$1"
