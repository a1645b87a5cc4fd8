//! In: topics with their quality of service, and messages. Out: publishers in Zenoh that rmw_zenoh takes for its own:
//! tokens, keys, attachments, and the last messages kept for later subscribers.

use super::fault::{Fault, fault};
use super::names::Place;
use super::options::{HERE, Options};
use super::qos::Qos;
use std::time::{Duration, SystemTime};
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

/// How soon subscribers of kept topics notice a lost message; rmw_zenoh has the same.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Most time for the last messages.
const CLOSING: Duration = Duration::from_secs(2);

const MOMENT: Duration = Duration::from_millis(300);

/// The session.
pub struct Door {
    session: Session,
    place: Place,
    // It stands as long as the session.
    _node: LivelinessToken,
    entities: u32,
    /// Whether a router was reached when it was last asked; none is needed where the session listens.
    reached: Option<bool>,
}

/// A topic that is published.
pub struct Topic {
    publisher: AdvancedPublisher<'static>,
    _token: LivelinessToken,
    /// Number of the next message; the first is 1.
    next: i64,
    identity: [u8; 16],
}

impl Door {
    /// Connects to the router, or listens.
    pub fn open(options: &Options, domain: u32) -> Result<Door, Fault> {
        let session = zenoh::open(config(options)?).wait().map_err(|e| match &options.listen {
            Some(address) => fault(
                format!("--listen {address}: cannot be listened on: {e}"),
                "another program has the port, or the address is not this machine's",
                "choose another address or port, or connect to the router that is there",
            ),
            None => fault(
                format!("no router at {}: {e}", options.connect.as_deref().unwrap_or(HERE)),
                "the router does not run, or another machine has it",
                "start it (ros2 run rmw_zenoh_cpp rmw_zenohd), name it with --connect, or give --listen",
            ),
        })?;
        let namespace = options.namespace.clone();
        let place = Place { domain, namespace, session: session.zid().to_string() };
        let node = session.liveliness().declare_token(place.node()).wait().map_err(lost)?;
        let reached = options.listen.is_none().then_some(true);
        Ok(Door { session, place, _node: node, entities: 0, reached })
    }

    /// The topic's whole name.
    pub fn name(&self, topic: &str) -> String {
        self.place.topic(topic)
    }

    /// Begins to publish a topic.
    pub fn publish(&mut self, topic: &str, kind: &str, hash: &str, qos: Qos) -> Result<Topic, Fault> {
        self.entities += 1;
        let topic = self.place.topic(topic);
        let reliability = if qos.reliable { Reliability::Reliable } else { Reliability::BestEffort };
        // What a link does not take in time is dropped: nobody who does not read stops the others.
        let publisher = self.session.declare_publisher(self.place.key(&topic, kind, hash));
        let publisher = publisher.congestion_control(CongestionControl::Drop).reliability(reliability);
        let mut publisher = publisher.advanced();
        if qos.kept {
            publisher = publisher.publisher_detection().cache(CacheConfig::default().max_samples(qos.depth));
            if qos.reliable {
                publisher =
                    publisher.sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT));
            }
        }
        let publisher = publisher.wait().map_err(lost)?;
        let token = self.place.publisher(self.entities, &topic, kind, hash, &qos.words());
        let identity = identity(&token);
        let token = self.session.liveliness().declare_token(token).wait().map_err(lost)?;
        Ok(Topic { publisher, _token: token, next: 1, identity })
    }

    /// Says when the router is lost, and when it is there again.
    pub fn look(&mut self) {
        let Some(before) = self.reached else { return };
        let now = self.session.info().routers_zid().wait().next().is_some()
            || self.session.info().peers_zid().wait().next().is_some();
        match (before, now) {
            (true, false) => eprintln!("the router is lost; it is tried again, messages of meanwhile are lost"),
            (false, true) => eprintln!("the router is reached again"),
            _ => {}
        }
        self.reached = Some(now);
    }

    /// Ends the session: topics and node go. Who does not read what waits for it is not waited for.
    pub fn close(self) {
        // A question that nobody answers travels behind the messages: when the router says so, it has them. Closing
        // alone loses what waits for the link. Subscribers that are connected here get a moment.
        let asked = format!("@sheetlight/{}/sent", self.place.session);
        if let Ok(answers) = self.session.get(asked).timeout(CLOSING).wait() {
            while answers.recv().is_ok() {}
        }
        std::thread::sleep(MOMENT);
        let _ = self.session.close().timeout(CLOSING).wait();
    }
}

impl Topic {
    /// Sends a message.
    pub fn send(&mut self, message: &[u8]) -> Result<(), Fault> {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
        let attachment = attachment(self.next, now.as_nanos() as i64, self.identity);
        self.next += 1;
        self.publisher.put(message).attachment(&attachment[..]).wait().map_err(lost)
    }

    /// Number of messages that were sent.
    pub fn sent(&self) -> i64 {
        self.next - 1
    }
}

/// What travels with every message: its number, its time in ns since 1970, and the publisher's identity behind its
/// length.
fn attachment(number: i64, time_ns: i64, identity: [u8; 16]) -> [u8; 33] {
    let mut bytes = [0; 33];
    bytes[..8].copy_from_slice(&number.to_le_bytes());
    bytes[8..16].copy_from_slice(&time_ns.to_le_bytes());
    bytes[16] = identity.len() as u8;
    bytes[17..].copy_from_slice(&identity);
    bytes
}

/// The identity of a publisher, as rmw_zenoh computes it from the token: XXH3 of 128 bits, the low half first.
fn identity(token: &str) -> [u8; 16] {
    twox_hash::XxHash3_128::oneshot(token.as_bytes()).to_le_bytes()
}

fn config(options: &Options) -> Result<zenoh::Config, Fault> {
    let mut config = zenoh::Config::default();
    let (mode, connect, listen) = match &options.listen {
        Some(address) => ("peer", None, Some(address.as_str())),
        None => ("client", Some(options.connect.as_deref().unwrap_or(HERE)), None),
    };
    // A router takes what it gets; the wait bridges a moment in which the machine is busy. A subscriber that is
    // connected here and does not read costs that wait whenever its link is full.
    let patience_us = if options.listen.is_some() { 1_000 } else { 20_000 };
    let list = |endpoint: Option<&str>| serde_json::json!(endpoint.into_iter().collect::<Vec<_>>()).to_string();
    let settings = [
        ("mode", format!("\"{mode}\"")),
        ("connect/endpoints", list(connect)),
        ("listen/endpoints", list(listen)),
        ("scouting/multicast/enabled", options.multicast.to_string()),
        // Nobody is connected to that was not named.
        ("scouting/gossip/enabled", options.multicast.to_string()),
        // Kept messages are put in order by their times.
        ("timestamping/enabled", "true".to_owned()),
        // Packets of 64 kB that wait for a link: a picture has several.
        ("transport/link/tx/queue/size/data", "16".to_owned()),
        ("transport/link/tx/queue/congestion_control/drop/wait_before_drop", patience_us.to_string()),
    ];
    for (key, value) in settings {
        config.insert_json5(key, &value).map_err(|e| {
            fault(format!("Zenoh refuses its setting {key}: {e}"), "a fault of this program", "report it")
        })?;
    }
    Ok(config)
}

fn lost(e: zenoh::Error) -> Fault {
    fault(format!("Zenoh: {e}"), "the session was closed", "start it again")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_attachment_is_the_bytes_of_rmw_zenoh() {
        let bytes = attachment(3, 0x0102_0304_0506_0708, [9; 16]);
        let expected = [&[3, 0, 0, 0, 0, 0, 0, 0, 8, 7, 6, 5, 4, 3, 2, 1, 16][..], &[9; 16]].concat();
        assert_eq!(bytes[..], expected[..]);
    }
}
