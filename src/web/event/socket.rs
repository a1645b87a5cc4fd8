//! In: a viewer's WebSocket. Out: the state, then events and rows of the growing map as fast as the viewer takes them.
//! Frame and unit: seconds, bytes.

use super::Hub;
use super::hub::Seat;
use crate::web::message::Event;
use axum::extract::ws::{Message, WebSocket};
use futures_util::stream::{SplitSink, SplitStream};
use futures_util::{SinkExt, StreamExt};
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, error::RecvError};
use tokio::time::{MissedTickBehavior, interval, timeout};

/// A viewer that takes nothing for so long is let go.
const PATIENCE: Duration = Duration::from_secs(20);
/// Rows of the growing map are sent this often at most.
const PICTURE: Duration = Duration::from_millis(100);

/// Serves one viewer until it goes. `state` is asked for at first and whenever events were missed; `hears` gets what it says: at once,
/// however slowly it takes what it is sent, because a button that is held must be heard.
pub async fn stream(
    socket: WebSocket,
    hub: Arc<Hub>,
    (_seat, events): (Seat, Receiver<Arc<str>>),
    state: impl Fn() -> Event + Send,
    hears: impl Fn(&str) + Send,
) {
    let (sink, said) = socket.split();
    tokio::select! {
        () = told(sink, &hub, events, state) => {}
        () = heard(said, hears) => {}
    }
}

/// Tells the viewer what happens until it takes nothing any more.
async fn told(
    mut viewer: SplitSink<WebSocket, Message>,
    hub: &Hub,
    mut events: Receiver<Arc<str>>,
    state: impl Fn() -> Event + Send,
) {
    let mut pictures = interval(PICTURE);
    pictures.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut shown = (0, 0);
    let mut next = Some(Message::text(text(&state())));
    loop {
        if let Some(message) = next.take() {
            match timeout(PATIENCE, viewer.send(message)).await {
                Ok(Ok(())) => {}
                _ => return,
            }
        }
        tokio::select! {
            event = events.recv() => next = match event {
                Ok(event) => Some(Message::text(event.to_string())),
                Err(RecvError::Lagged(_)) => Some(Message::text(text(&state()))),
                Err(RecvError::Closed) => return,
            },
            _ = pictures.tick() => next = rows(hub, &mut shown),
        }
    }
}

/// Hears the viewer until it goes. All that viewers say here is that a button is held; what they order goes through the API.
async fn heard(mut viewer: SplitStream<WebSocket>, hears: impl Fn(&str) + Send) {
    while let Some(Ok(message)) = viewer.next().await {
        match message {
            Message::Text(text) => hears(&text),
            Message::Close(_) => return,
            _ => {}
        }
    }
}

fn text(event: &Event) -> String {
    serde_json::to_string(event).expect("plain data")
}

/// What this viewer has not seen of the growing map.
fn rows(hub: &Hub, shown: &mut (u32, usize)) -> Option<Message> {
    let (job, done) = hub.growing.at();
    // The last row of what was sent may have got more shots since.
    let from = if job == shown.0 { shown.1.saturating_sub(1) } else { 0 };
    if job == shown.0 && done == shown.1 {
        return None;
    }
    *shown = (job, done);
    hub.growing.message(from).map(Message::binary)
}
