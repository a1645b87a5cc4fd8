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
const PICTURE: Duration = Duration::from_millis(250);

/// Serves one viewer until it goes. `state` is asked for at first and whenever events were missed, beside the
/// server's own threads: it looks at the disk. `hears` gets what the viewer says, in a task of its own: however long
/// telling takes, a button that is held is heard.
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

/// Tells the viewer what happens until it takes nothing any more.
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

/// Hears the viewer until it goes. All that viewers say here is that a button is held; what they order goes through
/// the API.
async fn heard(mut viewer: SplitStream<WebSocket>, hears: impl Fn(&str) + Send) {
    while let Some(Ok(message)) = viewer.next().await {
        match message {
            Message::Text(text) => hears(&text),
            Message::Close(_) => return,
            _ => {}
        }
    }
}

/// The state as a message; `None` where the server ends.
async fn whole(state: &Arc<impl Fn() -> Event + Send + Sync + 'static>) -> Option<Message> {
    let state = state.clone();
    let text = move || serde_json::to_string(&state()).expect("plain data");
    tokio::task::spawn_blocking(text).await.ok().map(Message::text)
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
