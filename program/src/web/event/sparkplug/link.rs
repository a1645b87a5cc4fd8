//! In: events of jobs and bar, an MQTT broker. Out: the station as a node of Sparkplug B 3.0. One topic is subscribed
//! to, and the only thing that can be ordered there is that all values are published again.
//! Frame and unit: ms since 1970.

use super::node::{Draft, Node, death};
use super::payload::asks_for_birth;
use super::seen::Seen;
use crate::web::event::mqtt::{AGAIN, DOOR, WAITING};
use crate::web::event::{Broker, Hub, Names};
use crate::web::message::Job;
use rumqttc::{AsyncClient, ConnectionError, Event, EventLoop, LastWill, Packet, QoS, SubscribeReasonCode};
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use tokio::sync::Notify;
use tokio::sync::broadcast::{Receiver, error::RecvError};
use tokio::time::{Instant, sleep_until};

/// Births of a session are at least this far apart, however many commands ask for one.
const BETWEEN: Duration = Duration::from_secs(1);

/// Where the values come from.
pub struct Source<J, R> {
    /// Events.
    pub hub: Arc<Hub>,
    /// The jobs, the newest first.
    pub jobs: J,
    /// Pictures a second of the camera.
    pub rate_hz: R,
}

impl<J: Fn() -> Vec<Job>, R: Fn() -> Option<f64>> Source<J, R> {
    /// Takes all jobs as they are now.
    fn catch_up(&self, seen: &mut Seen) {
        for job in (self.jobs)().iter().rev() {
            seen.job(serde_json::to_value(job).expect("plain data"));
        }
    }

    /// Takes the next event. True: others hear of it now. `None`: there will be no more.
    async fn next(&self, events: &mut Receiver<Arc<str>>, seen: &mut Seen) -> Option<bool> {
        let told = match events.recv().await {
            Ok(text) => seen.take(serde_json::from_str(&text).expect("the hub's own text")),
            Err(RecvError::Lagged(_)) => {
                self.catch_up(seen);
                false
            }
            Err(RecvError::Closed) => return None,
        };
        seen.rate_hz = (self.rate_hz)();
        Some(told)
    }

    /// Reads events while no connection publishes them. Returns at the end of the events.
    async fn watch(&self, events: &mut Receiver<Arc<str>>, seen: &mut Seen) {
        while self.next(events, seen).await.is_some() {}
    }
}

/// Publishes until the server ends. A slow or missing broker delays nothing.
pub async fn publish<J, R>(broker: Broker, names: Names, source: Source<J, R>)
where
    J: Fn() -> Vec<Job>,
    R: Fn() -> Option<f64>,
{
    let mut events = source.hub.listen();
    let mut seen = Seen::default();
    source.catch_up(&mut seen);
    let hub = source.hub.clone();
    hub.link(DOOR, |link| {
        link.address = broker.name();
        link.problem = Some(format!("{} was not reached yet", broker.name()));
    });
    let (mut session, mut wait) = (0_u8, AGAIN[0]);
    loop {
        // A client of its own for each session: what waited for a lost broker must not come before the next birth.
        let will = LastWill::new(names.topic("NDEATH"), death(session, now_ms()), QoS::AtLeastOnce, false);
        let (client, connection) = AsyncClient::new(broker.options(names.client(), will), WAITING);
        let link = Link { broker: &broker, names: &names, hub: &hub, client, birth: Notify::new() };
        let (why, connected) = tokio::select! {
            ended = link.hold(connection) => ended,
            () = link.pass_on(&mut events, &mut seen, &source, session) => return,
        };
        hub.link(DOOR, |link| {
            link.problem = Some(format!("{} does not answer: {why}", broker.name()));
            link.peers.clear();
        });
        // The next session has the next number. A broker that was never asked for one had none.
        if connected || !matches!(why, ConnectionError::Io(_) | ConnectionError::Tls(_)) {
            session = session.wrapping_add(1);
        }
        wait = if connected { AGAIN[0] } else { wait };
        tokio::select! {
            () = tokio::time::sleep(wait) => {}
            () = source.watch(&mut events, &mut seen) => return,
        }
        wait = (2 * wait).min(AGAIN[1]);
    }
}

/// One session at the broker.
struct Link<'a> {
    broker: &'a Broker,
    names: &'a Names,
    hub: &'a Hub,
    client: AsyncClient,
    /// A birth is due.
    birth: Notify,
}

impl Link<'_> {
    /// Holds the connection. Returns why it ended, and whether the broker had accepted it.
    async fn hold(&self, mut connection: EventLoop) -> (ConnectionError, bool) {
        let mut connected = false;
        loop {
            match connection.poll().await {
                Ok(Event::Incoming(packet)) => {
                    connected |= matches!(packet, Packet::ConnAck(_));
                    self.came(&packet);
                }
                Ok(Event::Outgoing(_)) => {}
                Err(why) => return (why, connected),
            }
        }
    }

    fn came(&self, packet: &Packet) {
        match packet {
            Packet::ConnAck(_) => {
                self.hub.link(DOOR, |link| {
                    link.problem = None;
                    link.peers = vec![self.broker.name()];
                });
                // Before the birth: a host application may answer that with a command.
                let _ = self.client.try_subscribe(self.names.topic("NCMD"), QoS::AtLeastOnce);
                self.birth.notify_one();
            }
            Packet::SubAck(granted) if granted.return_codes.contains(&SubscribeReasonCode::Failure) => {
                self.hub.link(DOOR, |link| {
                    link.last_error =
                        Some("the broker refuses the subscription to NCMD: no host can ask for a birth".into())
                });
            }
            // A command that the broker kept was not meant for this session.
            Packet::Publish(command) if !command.retain && asks_for_birth(&command.payload) => self.birth.notify_one(),
            _ => {}
        }
    }

    /// Sends births and data. Between a command and its birth no data are sent: the birth has them.
    async fn pass_on<J, R>(&self, events: &mut Receiver<Arc<str>>, seen: &mut Seen, source: &Source<J, R>, session: u8)
    where
        J: Fn() -> Vec<Job>,
        R: Fn() -> Option<f64>,
    {
        let (mut node, mut born, mut asked, mut at) = (Node::default(), false, false, Instant::now());
        loop {
            tokio::select! {
                event = source.next(events, seen) => match event {
                    Some(told) => {
                        if told && born && !asked && let Some(draft) = node.data(seen, now_ms()) {
                            self.send(draft, &mut node);
                        }
                    }
                    None => return,
                },
                () = self.birth.notified() => asked = true,
                // The first birth waits for the first bar.
                () = sleep_until(at), if asked && !seen.bar.is_null() => {
                    asked = !self.send(Node::birth(seen, session, now_ms()), &mut node);
                    born |= !asked;
                    at = Instant::now() + BETWEEN;
                }
            }
        }
    }

    fn send(&self, mut draft: Draft, node: &mut Node) -> bool {
        let (topic, bytes) = (self.names.topic(draft.kind), std::mem::take(&mut draft.bytes));
        let handed = self.client.try_publish(topic, QoS::AtMostOnce, false, bytes).is_ok();
        if handed {
            node.handed(draft);
        }
        self.hub.link(DOOR, |link| if handed { link.sent += 1 } else { link.lost += 1 });
        handed
    }
}

fn now_ms() -> u64 {
    SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_millis() as u64)
}
