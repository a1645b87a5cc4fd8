//! In: the path of a page. Out: its file, which is embedded in the program.
//! Frame and unit: none.

use super::guard::plain;
use axum::http::{HeaderValue, StatusCode, Uri, header};
use axum::response::{IntoResponse, Response};

#[derive(rust_embed::RustEmbed)]
#[folder = "src/web/pages"]
struct Files;

fn kind(path: &str) -> Option<&'static str> {
    Some(match path.rsplit_once('.')?.1 {
        "html" => "text/html; charset=utf-8",
        "js" => "text/javascript; charset=utf-8",
        "css" => "text/css; charset=utf-8",
        "json" => "application/json",
        "svg" => "image/svg+xml",
        "webmanifest" => "application/manifest+json",
        _ => return None,
    })
}

/// Serves a file; `/` is the page that shows all others. Invalid names are not looked up.
pub async fn page(uri: Uri) -> Response {
    let path = match uri.path().trim_start_matches('/') {
        "" => "index.html",
        path => path,
    };
    let found = path.split('/').all(plain).then(|| Files::get(path)).flatten().zip(kind(path));
    match found {
        Some((file, kind)) => {
            let headers = [
                (header::CONTENT_TYPE, HeaderValue::from_static(kind)),
                // The browser must revalidate each time, because a newer program has newer pages.
                (header::CACHE_CONTROL, HeaderValue::from_static("no-cache")),
            ];
            (headers, file.data).into_response()
        }
        None => (StatusCode::NOT_FOUND, "no such page").into_response(),
    }
}
