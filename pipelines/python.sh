# Sourced by the pipelines that draw: finds a python3 with matplotlib.
python=
for candidate in python3 /usr/bin/python3; do
  "$candidate" -c 'import matplotlib' 2>/dev/null && { python=$candidate; break; }
done
[ -n "$python" ] || { echo "no python3 with matplotlib, expected Debian's python3-matplotlib" >&2; exit 1; }
