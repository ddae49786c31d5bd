#!/usr/bin/env bash
# Fetches models of strangers from GitHub, each at its commit, into a folder: `bash scripts/strangers.sh FOLDER [TABLE...]`. Without a
# table (52, 58, data) it takes all of scripts/strangers.tsv, some 260 MB. What is there already is passed over. A glTF or OBJ has a folder of its own,
# with the buffers, pictures and materials that it names. Then: `bash scripts/gauntlet.sh FOLDER`. Needs curl and python3; FROM names a mirror.
set -euo pipefail
[ $# -gt 0 ] || { echo "usage: strangers.sh FOLDER [TABLE...]" >&2 && exit 2; }
root=$(cd "$(dirname "$0")/.." && pwd)
from=${FROM:-https://raw.githubusercontent.com}
folder=$1
tables=" ${*:2} "
missing=() lacking=()

# fetch REPOSITORY/COMMIT PATH FILE: what is cut off or only a pointer of Git LFS does not stay.
fetch() {
  local part=$3.part code=0
  [ ! -e "$3" ] || return 0
  mkdir -p "$(dirname "$3")"
  curl -fsSL --retry 3 -o "$part" "$from/$1/$(python3 -c 'import sys, urllib.parse; print(urllib.parse.quote(sys.argv[1]))' "$2")" || code=$?
  if [ $code -eq 0 ] && ! head -c 40 "$part" | grep -aq '^version https://git-lfs'; then
    mv "$part" "$3"
    return 0
  fi
  rm -f "$part"
  # 22: the server has no such file.
  if [ $code -eq 22 ] && [ "$3" != "$model" ]; then lacking+=("${3#"$folder"/}"); else missing+=("${3#"$folder"/}"); fi
}

# The files that a model names, a line each, but none outside of its own folder.
named() {
  python3 - "$1" <<'PYTHON'
import json, os, re, sys, urllib.parse

data = open(sys.argv[1], "rb").read()
if sys.argv[1].endswith(".gltf"):
    model = json.loads(data)
    names = [part.get("uri", "data:") for key in ("buffers", "images") for part in model.get(key, [])]
    names = [urllib.parse.unquote(name) for name in names if not name.startswith("data:")]
else:
    names = re.findall(r"^mtllib[ \t]+(.*\S)", data.decode("utf-8", "replace"), re.M)
for name in dict.fromkeys(os.path.normpath(name.replace("\\", "/")) for name in names):
    if name.isprintable() and not re.match(r"/|\.\.|[A-Za-z][\w+.-]*:", name):
        print(name)
PYTHON
}

while IFS=$'\t' read -r name repository commit path _ _ _ table; do
  case $name in '' | '#'*) continue ;; esac
  [[ $tables =~ ^\ +$ || $tables == *" $table "* ]] || continue
  model=$folder/$name
  case $name in *.gltf | *.obj) model=$folder/${name%.*}/$name ;; esac
  fetch "$repository/$commit" "$path" "$model"
  case $name in
    *.gltf | *.obj)
      [ -e "$model" ] || continue
      while IFS= read -r other; do
        fetch "$repository/$commit" "$(dirname "$path")/$other" "$(dirname "$model")/$other"
      done < <(named "$model")
      ;;
  esac
done <"$root/scripts/strangers.tsv"

[ ${#lacking[@]} -eq 0 ] || printf 'named by its model, but not to be had: %s\n' "${lacking[@]}" >&2
[ ${#missing[@]} -eq 0 ] || { printf 'not fetched: %s\n' "${missing[@]}" >&2 && exit 1; }
