#!/usr/bin/env bash
# In: the screen's pages. Out: a failure where one is not formatted (prettier) or uses a value against its type (tsc).
# `tools/pages.sh --write` formats them. The tools are downloaded once; a machine that cannot get them says so and goes
# on: the pages themselves are tested in a browser.
set -eu
cd "$(dirname "$0")/pages"
if ! { command -v npm && npm install --silent --no-audit --no-fund --no-package-lock; } >/dev/null; then
  echo "*** SKIPPED: no prettier and TypeScript by npm here: format and types of the pages are not checked ***" >&2
  exit 0
fi
mode=${1:---check}
node_modules/.bin/prettier --config prettier.json --log-level warn "$mode" \
  "../../program/src/web/pages/**/*.js" ../../src/station/judge/viewer.js
node_modules/.bin/tsc --project .
