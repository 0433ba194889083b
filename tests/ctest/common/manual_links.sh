# Checks that the links of a manual lead to files, or to headings of its own: manual_links.sh FILE
set -eu
cd "$(dirname "$1")"
manual=$(basename "$1")
links=$(grep -o "](\([^)]*\))" "$manual" | sed "s/^](//; s/)$//")
[ -n "$links" ]
# As Markdown's readers name them: small letters, without punctuation, a hyphen for each blank.
headings=$(sed -n 's/^##* //p' "$manual" | tr '[:upper:]' '[:lower:]' | sed 's/[^a-z0-9 _-]//g; s/ /-/g')
for link in $links; do
    case $link in
    http*) ;;
    '#'*) echo "$headings" | grep -qx -- "${link#?}" || { echo "$1: no heading $link"; exit 1; } ;;
    *) [ -f "${link%%#*}" ] || { echo "$1: no $link"; exit 1; } ;;
    esac
done
