#!/usr/bin/env bash
# Figures of a page that `enfilade report` wrote, as a picture: scripts/page-picture.sh PAGE.html OUT.png [FIGURES HEIGHT]. FIGURES is
# what `:nth-of-type` takes, or several with commas: the charts of a level, if it isn't given. Needs chromium.
set -euo pipefail
page=$(mktemp --suffix=.html)
trap 'rm -f "$page"' EXIT
style='body{max-width:none;margin:0;padding:10px;width:860px}body>*{display:none!important}figcaption{display:none!important}'
IFS=, read -ra figures <<<"${3:-1,2}"
for n in "${figures[@]}"; do
    style+="body>figure:nth-of-type($n){display:block!important;margin:0 0 10px}"
done
sed "s|</style>|$style&|" "$1" >"$page"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size="860,${4:-930}" --screenshot="$2" "file://$page" 2>/dev/null
