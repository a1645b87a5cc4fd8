//! In: a viewer's WebSocket. Out: the state, then events and rows of the growing map as fast as the viewer accepts
//! them.
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

/// A viewer that accepts nothing for this long is disconnected.
const PATIENCE: Duration = Duration::from_secs(20);
/// Shortest interval between rows of the growing map.
const PICTURE: Duration = Duration::from_millis(250);

/// Serves one viewer until it disconnects. `state` is called at first and whenever events were missed, outside the
/// server's threads, because it reads the disk. `hears` gets the viewer's messages in a separate task, so that a
/// held button is noticed however long sending takes.
pub async fn stream(
    socket: WebSocket,
    hub: Arc<Hub>,
    (_seat, events): (Seat, Receiver<Arc<str>>),
    state: impl Fn() -> Event + Send + Sync + 'static,
    hears: impl Fn(&str) + Send + 'static,
) {
    let (sink, said) = socket.split();
    let mut hearing = tokio::spawn(heard(said, hears));
    tokio::select! {
        () = told(sink, &hub, events, Arc::new(state)) => hearing.abort(),
        _ = &mut hearing => {}
    }
}

/// Sends events to the viewer until it accepts no more.
async fn told(
    mut viewer: SplitSink<WebSocket, Message>,
    hub: &Hub,
    mut events: Receiver<Arc<str>>,
    state: Arc<impl Fn() -> Event + Send + Sync + 'static>,
) {
    let mut pictures = interval(PICTURE);
    pictures.set_missed_tick_behavior(MissedTickBehavior::Delay);
    let mut shown = (0, 0);
    let mut next = whole(&state).await;
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
                Err(RecvError::Lagged(_)) => whole(&state).await,
                Err(RecvError::Closed) => return,
            },
            _ = pictures.tick() => next = rows(hub, &mut shown),
        }
    }
}

/// Receives messages until the viewer disconnects. The only message of viewers here is that a button is held;
/// orders go through the API.
async fn heard(mut viewer: SplitStream<WebSocket>, hears: impl Fn(&str) + Send) {
    while let Some(Ok(message)) = viewer.next().await {
        match message {
            Message::Text(text) => hears(&text),
            Message::Close(_) => return,
            _ => {}
        }
    }
}

/// The state as a message; `None` if the server is shutting down.
async fn whole(state: &Arc<impl Fn() -> Event + Send + Sync + 'static>) -> Option<Message> {
    let state = state.clone();
    let text = move || serde_json::to_string(&state()).expect("plain data");
    tokio::task::spawn_blocking(text).await.ok().map(Message::text)
}

/// Rows of the growing map that this viewer does not have yet.
fn rows(hub: &Hub, shown: &mut (u32, usize)) -> Option<Message> {
    let (job, done) = hub.growing.at();
    // The last row that was sent may contain more shots now.
    let from = if job == shown.0 { shown.1.saturating_sub(1) } else { 0 };
    if job == shown.0 && done == shown.1 {
        return None;
    }
    *shown = (job, done);
    hub.growing.message(from).map(Message::binary)
}
