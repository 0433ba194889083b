# Checks that the links of a manual lead to files: manual_links.sh FILE
set -eu
cd "$(dirname "$1")"
links=$(grep -o "](\([^)]*\))" "$(basename "$1")" | sed "s/^](//; s/)$//")
[ -n "$links" ]
for link in $links; do
    case $link in
    http*) ;;
    *) [ -f "$link" ] || { echo "$1: no $link"; exit 1; } ;;
    esac
done
