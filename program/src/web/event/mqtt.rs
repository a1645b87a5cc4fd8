//! In: events of jobs and bar. Out: the station's state, its jobs and their results at an MQTT broker. Nothing is
//! subscribed to: a broker cannot order anything here.
//! Frame and unit: those of the events.

use super::{Broker, Hub};
use crate::web::guard::random_hex;
use rumqttc::{AsyncClient, Event, EventLoop, LastWill, Packet, QoS};
use serde_json::Value;
use std::collections::HashMap;
use std::sync::Arc;
use std::time::Duration;
use tokio::sync::broadcast::{Receiver, error::RecvError};
use tokio::sync::watch;

/// Messages that wait for a broker; what comes while all places are taken is not sent.
pub(super) const WAITING: usize = 64;
/// First and longest wait before the next attempt to connect.
pub(super) const AGAIN: [Duration; 2] = [Duration::from_secs(1), Duration::from_secs(30)];

/// Topic of the bar.
const BAR: &str = "status";

/// Name of this door among the links.
pub const DOOR: &str = "mqtt";

/// Publishes until the server ends. A slow or missing broker delays nothing.
pub async fn publish(broker: Broker, hub: Arc<Hub>) {
    let events = hub.listen();
    let name = format!("sheetlight-{}", &random_hex()[..12]);
    let will = LastWill::new(broker.topic("state"), "offline", QoS::AtLeastOnce, true);
    let (client, connection) = AsyncClient::new(broker.options(name, will), WAITING);
    hub.link(DOOR, |link| {
        link.address = broker.name();
        link.problem = Some(format!("{} was not reached yet", broker.name()));
    });
    let (told, connected) = watch::channel(false);
    tokio::join!(hold(&broker, &hub, &told, connection), pass_on(&broker, &hub, &client, events, connected));
}

/// Holds the connection, makes it again, and tells whether there is one.
async fn hold(broker: &Broker, hub: &Hub, connected: &watch::Sender<bool>, mut connection: EventLoop) {
    let mut wait = AGAIN[0];
    loop {
        match connection.poll().await {
            Ok(Event::Incoming(Packet::ConnAck(_))) => {
                hub.link(DOOR, |link| {
                    link.problem = None;
                    link.peers = vec![broker.name()];
                });
                wait = AGAIN[0];
                connected.send_replace(true);
            }
            Ok(_) => {}
            Err(e) => {
                connected.send_replace(false);
                hub.link(DOOR, |link| {
                    link.problem = Some(format!("{} does not answer: {e}", broker.name()));
                    link.peers.clear();
                });
                tokio::time::sleep(wait).await;
                wait = (2 * wait).min(AGAIN[1]);
            }
        }
    }
}

/// Sends what is of use to others. While there is no connection, the places of waiting messages are for jobs and their
/// results: the bar comes again.
async fn pass_on(
    broker: &Broker,
    hub: &Hub,
    client: &AsyncClient,
    mut events: Receiver<Arc<str>>,
    mut connected: watch::Receiver<bool>,
) {
    let mut states = States::default();
    loop {
        let event = tokio::select! {
            event = events.recv() => event,
            Ok(()) = connected.changed() => {
                if *connected.borrow_and_update() {
                    // Waits for a place: after a long outage all are taken.
                    let _ = client.publish(broker.topic("state"), QoS::AtLeastOnce, true, "online").await;
                }
                continue;
            }
        };
        match event {
            Ok(text) => {
                let bars = *connected.borrow();
                let messages = states.messages(&serde_json::from_str(&text).expect("the hub's own text"));
                for message in messages.into_iter().filter(|message| bars || message.topic != BAR) {
                    let (topic, qos) = (broker.topic(&message.topic), QoS::AtLeastOnce);
                    let handed = client.try_publish(topic, qos, message.kept, message.text).is_ok();
                    hub.link(DOOR, |link| if handed { link.sent += 1 } else { link.lost += 1 });
                }
            }
            Err(RecvError::Lagged(_)) => {}
            Err(RecvError::Closed) => return,
        }
    }
}

/// A message below the station's topic. The broker keeps the last one of a topic that is `kept` for later subscribers.
#[derive(Debug, PartialEq)]
struct Message {
    topic: String,
    kept: bool,
    text: String,
}

/// The last known state of each job, to tell a change from progress.
#[derive(Default)]
struct States(HashMap<String, String>);

impl States {
    /// What an event gives: the bar as it is; a job whenever its state changes, and its result when it is done.
    fn messages(&mut self, event: &Value) -> Vec<Message> {
        let data = &event["data"];
        match event["event"].as_str() {
            Some("bar") => vec![Message { topic: BAR.into(), kept: true, text: data.to_string() }],
            Some("job") => self.job(data),
            Some("gone") => {
                data.as_str().map(|id| self.0.remove(id));
                Vec::new()
            }
            _ => Vec::new(),
        }
    }

    fn job(&mut self, job: &Value) -> Vec<Message> {
        let [id, state] = ["id", "state"].map(|key| job[key].as_str().unwrap_or_default().to_owned());
        if self.0.insert(id, state.clone()).as_ref() == Some(&state) {
            return Vec::new();
        }
        let procedure = job["order"]["procedure"].as_str().unwrap_or("unknown");
        let mut messages = vec![Message { topic: format!("job/{procedure}"), kept: false, text: job.to_string() }];
        if state == "done" {
            messages.push(Message { topic: format!("result/{procedure}"), kept: true, text: job.to_string() });
        }
        messages
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn job(id: &str, state: &str, done: usize) -> Value {
        json!({"event": "job", "data": {"id": id, "state": state, "done": done, "order": {"procedure": "scan"}}})
    }

    #[test]
    fn a_job_is_published_when_its_state_changes_and_its_result_is_kept() {
        let mut states = States::default();
        let mut told = |event: &Value| -> Vec<(String, bool)> {
            states.messages(event).into_iter().map(|m| (m.topic, m.kept)).collect()
        };
        let changed = vec![("job/scan".to_owned(), false)];
        assert_eq!(told(&job("1", "queued", 0)), changed);
        assert_eq!(told(&job("1", "running", 0)), changed);
        assert_eq!(told(&job("1", "running", 7)), []);
        assert_eq!(told(&job("2", "running", 0)), changed);
        assert_eq!(told(&job("1", "done", 9)), [changed[0].clone(), ("result/scan".to_owned(), true)]);
        assert_eq!(told(&job("2", "failed", 3)), changed);
        assert_eq!(told(&json!({"event": "bar", "data": {"station": "x"}})), [("status".to_owned(), true)]);
        assert_eq!(told(&json!({"event": "motion", "data": {}})), []);
        // A job that was removed is forgotten: memory does not grow with the jobs of years.
        assert_eq!(told(&json!({"event": "gone", "data": "1"})), []);
        assert_eq!(states.0.len(), 1);
    }
}
