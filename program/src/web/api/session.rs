//! In: the token of this program start, or a password; tabs that want to operate. Out: a session's cookie; the
//! lease.
//! Frame and unit: seconds.

use super::answer::{Answer, Refusal, afterwards, body, operates};
use crate::web::event::stream;
use crate::web::guard::{Peer, Tab, Tried};
use crate::web::message::{Event, Knock, Lease, Session, TakeLease};
use crate::web::screen::Screen;
use axum::body::Bytes;
use axum::extract::{ConnectInfo, Query, State, WebSocketUpgrade};
use axum::http::{HeaderMap, HeaderValue, StatusCode, header};
use axum::response::{IntoResponse, Response};
use axum::{Extension, Json};
use sheetlight::fault::Fault;
use std::sync::Arc;
use std::time::Duration;

/// POST /session: `{"token"}` or `{"password"}`; sets the cookie.
pub async fn open(
    State(screen): State<Arc<Screen>>,
    ConnectInfo(peer): ConnectInfo<Peer>,
    bytes: Bytes,
) -> Answer<Response> {
    let knock: Knock = body(&bytes)?;
    let known = match (knock.token, knock.password, &screen.password) {
        (Some(token), None, _) => screen.sessions.is_token(&token),
        (None, Some(password), Some(tries)) => match tries.one(peer.machine(), password).await? {
            Tried::TooMany(after) => return Ok(too_many(after)),
            tried => matches!(tried, Tried::Right),
        },
        _ => false,
    };
    if !known {
        let fault = Fault::refused("this is not the token of this start, nor the password")
            .cause("the program was started again since, or a slip of the hand")
            .next("open the address that the program printed when it was started");
        return Err(Refusal(StatusCode::UNAUTHORIZED, fault));
    }
    let secure = if screen.password.is_some() { "; Secure" } else { "" };
    let cookie = format!("{}={}; Path=/; HttpOnly; SameSite=Strict{secure}", screen.cookie, screen.sessions.open());
    let mut headers = HeaderMap::new();
    headers.insert(header::SET_COOKIE, HeaderValue::from_str(&cookie).expect("hexadecimal digits"));
    Ok((headers, Json(serde_json::json!({}))).into_response())
}

fn too_many(after: Duration) -> Response {
    let seconds = after.as_secs_f64().ceil().max(1.0);
    let fault = Fault::refused(format!("too many passwords were tried from here: the next one in {seconds} s"))
        .cause("each machine's tries come one after the other")
        .next("wait, then try again");
    ([(header::RETRY_AFTER, seconds.to_string())], Refusal(StatusCode::TOO_MANY_REQUESTS, fault)).into_response()
}

/// GET /session: the tab's name in the session.
pub async fn state(State(_): State<Arc<Screen>>, Extension(tab): Extension<Tab>) -> Json<Session> {
    Json(Session { tab: tab.short() })
}

/// POST /lease: takes or renews the lease for this tab.
pub async fn take(
    State(screen): State<Arc<Screen>>,
    Extension(tab): Extension<Tab>,
    bytes: Bytes,
) -> Answer<Json<Lease>> {
    let ask: TakeLease = if bytes.is_empty() { TakeLease::default() } else { body(&bytes)? };
    if tab.tab == "none" {
        return Err(Fault::usage("the request names no tab")
            .next("send the header X-Sheetlight-Tab with a name of your own")
            .into());
    }
    // Handled here, as STOP is: a motion of the previous operator halts at once. The bar reads the disk and is sent
    // afterwards.
    let other = screen.leases.take(&tab, ask.firmly)?;
    let lease = screen.leases.state();
    if other {
        screen.desk.handed_over();
        afterwards(screen, tell_bar);
    }
    Ok(Json(lease))
}

/// POST /lease/release: releases the lease.
pub async fn release(State(screen): State<Arc<Screen>>, Extension(tab): Extension<Tab>) -> Answer<Json<Lease>> {
    operates(&screen, &tab)?;
    screen.desk.let_go(&tab, "the operator let another screen operate");
    screen.leases.release(&tab);
    let lease = screen.leases.state();
    afterwards(screen, tell_bar);
    Ok(Json(lease))
}

fn tell_bar(screen: &Screen) {
    screen.hub.tell(&Event::Bar(screen.bar()));
}

/// The tab that watches.
#[derive(serde::Deserialize)]
pub struct Who {
    #[serde(default)]
    tab: String,
}

/// GET /events: the WebSocket. A tab that holds the button sends `held GRANT` over it; when the socket closes, a
/// motion of that tab is halted.
pub async fn events(
    State(screen): State<Arc<Screen>>,
    Extension(asks): Extension<Tab>,
    Query(who): Query<Who>,
    upgrade: WebSocketUpgrade,
) -> Answer<Response> {
    let Some(seat) = screen.hub.sit() else {
        let fault = Fault::refused("64 browsers are connected already").next("close one of them");
        return Err(Refusal(StatusCode::SERVICE_UNAVAILABLE, fault));
    };
    let hub = screen.hub.clone();
    // Messages from viewers are short.
    let upgrade = upgrade.max_message_size(1024).max_write_buffer_size(8 << 20);
    let name: String = who.tab.chars().filter(char::is_ascii_alphanumeric).take(32).collect();
    let tab = if name.is_empty() { asks } else { Tab { tab: name, ..asks } };
    Ok(upgrade.on_upgrade(async move |socket| {
        let (told, here, who) = (screen.clone(), screen.clone(), tab.clone());
        let hears = move |text: &str| {
            let Some(("held", grant)) = text.split_once(' ') else { return };
            // Only the operator may hold the button.
            if here.desk.held(&who, grant) && here.leases.need(&who).is_err() {
                here.desk.let_go(&who, "the operator's lease was lost");
            }
        };
        stream(socket, hub, seat, move || told.state(), hears).await;
        screen.desk.let_go(&tab, "the screen that held the button is gone");
    }))
}
