#!/usr/bin/env bash
# In: docs/. Out: the documents as a book with search in target/book, its links checked. A machine that cannot get
# mdBook says so and goes on: tests/docs/links.rs checks the links between the Markdown files.
set -eu
cd "$(dirname "$0")/.."
version=0.5.4
tools=${CARGO_TARGET_DIR:-target}/tools
book=$tools/bin/mdbook
if [ "$("$book" --version 2>/dev/null)" != "mdbook v$version" ]; then
  if ! "${CARGO:-cargo}" install --quiet --locked --debug --root "$tools" --target-dir "$tools/build" \
      --no-default-features --features search --version "$version" mdbook; then
    echo "*** SKIPPED: no mdBook by cargo here: the book of the documents is not built ***" >&2
    exit 0
  fi
  rm -rf "$tools/build"
fi
RUST_LOG=warn "$book" build
command -v python3 >/dev/null || { echo "*** SKIPPED: no Python here: the book's links are not checked ***" >&2; exit 0; }
python3 tools/book_links.py target/book "$(sed -n 's/^repository = "\(.*\)".*/\1/p' Cargo.toml | head -1)"
