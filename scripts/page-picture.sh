#!/usr/bin/env bash
# The charts of a page that `enfilade report` wrote, as a picture: scripts/page-picture.sh PAGE.html OUT.png. Needs chromium.
set -euo pipefail
page=$(mktemp --suffix=.html)
trap 'rm -f "$page"' EXIT
style='body{max-width:none;margin:0;padding:10px;width:860px}body>*,figcaption,body>figure:nth-of-type(3){display:none!important}'
style+='body>figure:nth-of-type(-n+2){display:block!important;margin:0 0 10px}'
sed "s|</style>|$style&|" "$1" >"$page"
chromium --headless --no-sandbox --disable-gpu --hide-scrollbars --window-size=860,930 --screenshot="$2" "file://$page" 2>/dev/null
