#!/usr/bin/env bash
# In: nothing. Out: a browser, its driver and openssl for the tests of the screen, where they are missing and we are allowed to install them.
# With CI=true a machine that still has none is a failure; for a user it is a sentence.
set -eu
have() { command -v openssl >/dev/null && command -v chromedriver >/dev/null && { command -v chromium || command -v google-chrome; } >/dev/null; }
if ! have && [ "$(id -u)" = 0 ] && command -v apt-get >/dev/null; then
  echo "installing a browser for the tests (chromium, chromium-driver, openssl)" >&2
  { apt-get -qq update && DEBIAN_FRONTEND=noninteractive apt-get -qq install -y chromium chromium-driver openssl; } >/dev/null 2>&1 || true
fi
if have; then exit 0; fi
echo "no chromium and chromedriver here: the tests of the screen's pages will be skipped" >&2
[ "${CI:-}" != true ]
