#!/usr/bin/env bash
# In: the screen's pages. Out: a failure where one is not formatted (prettier) or uses a value against its type (tsc).
# `tools/pages.sh --write` formats them. With CI=true a machine without npm is a failure; for a user it is a sentence.
set -eu
cd "$(dirname "$0")/pages"
if ! { command -v npm && npm install --silent --no-audit --no-fund --no-package-lock; } >/dev/null; then
  echo "no prettier and TypeScript by npm here: format and types of the screen's pages are not checked" >&2
  [ "${CI:-}" != true ]
  exit
fi
mode=${1:---check}
node_modules/.bin/prettier --config prettier.json --log-level warn "$mode" "../../src/web/pages/**/*.js" ../../src/station/judge/viewer.js
node_modules/.bin/tsc --project .
