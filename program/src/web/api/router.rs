//! In: the state that all requests share. Out: the server: the API from its table of routes, its description, the
//! pages.
//! Frame and unit: none.

use super::openapi::openapi;
use super::routes::{ROOT, routes};
use crate::web::guard::MOST_BODY;
use crate::web::pages::page;
use crate::web::screen::Screen;
use axum::Router;
use axum::extract::DefaultBodyLimit;
use axum::routing::get;
use std::sync::Arc;

/// The server's routes: the API, and the pages.
pub fn router(screen: Arc<Screen>) -> Router {
    let mut api = Router::new();
    for route in routes() {
        api = api.route(route.path, route.handler);
    }
    let description = get(|| async { axum::Json(openapi()) });
    Router::new()
        .nest(ROOT, api.route("/openapi.json", description))
        .fallback(get(page))
        .layer(DefaultBodyLimit::max(MOST_BODY))
        .with_state(screen)
}
