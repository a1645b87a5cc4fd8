//! In: topics with their quality of service, messages, and who answers calls. Out: publishers and services in Zenoh
//! that rmw_zenoh takes for its own: tokens, keys, attachments, and the last messages kept for later subscribers.

use super::definition::Definition;
use super::fault::{Fault, fault};
use super::hash;
use super::names::{Entity, Place};
use super::options::{HERE, Options};
use super::qos::Qos;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, SystemTime};
use zenoh::liveliness::LivelinessToken;
use zenoh::qos::{CongestionControl, Reliability};
use zenoh::query::{Query, Queryable};
use zenoh::{Session, Wait};
use zenoh_ext::{AdvancedPublisher, AdvancedPublisherBuilderExt, CacheConfig, MissDetectionConfig};

/// How soon subscribers of kept topics notice a lost message; rmw_zenoh has the same.
const HEARTBEAT: Duration = Duration::from_millis(500);

/// Most time for the last messages.
const CLOSING: Duration = Duration::from_secs(2);

const MOMENT: Duration = Duration::from_millis(300);

/// Most calls that are answered at a time.
const MOST_CALLS: usize = 16;
/// Quality of service that rmw_zenoh gives its services: reliable, depth 10.
const SERVICE: Qos = Qos { reliable: true, kept: false, depth: 10 };

/// The session.
pub struct Door {
    session: Session,
    place: Place,
    // It stands as long as the session.
    _node: LivelinessToken,
    entities: u32,
    /// Calls that are being answered.
    calls: Arc<AtomicUsize>,
    /// Whether a router was reached when it was last asked; none is needed where the session listens.
    reached: Option<bool>,
}

/// A service that answers, until it is dropped.
pub struct Service {
    _queryable: Queryable<()>,
    _token: LivelinessToken,
}

/// What a call gets.
pub enum Answered {
    /// The message of the answer.
    Bytes(Vec<u8>),
    /// The request is not of the service's type.
    Foreign(&'static str),
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
        Ok(Door { session, place, _node: node, entities: 0, calls: Arc::default(), reached })
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
        let token = self.place.entity(self.entities, Entity::Publisher, &topic, kind, hash, &qos.words());
        let identity = identity(&token);
        let token = self.session.liveliness().declare_token(token).wait().map_err(lost)?;
        Ok(Topic { publisher, _token: token, next: 1, identity })
    }

    /// Begins to publish a topic whose type is known here.
    pub fn publish_as(&mut self, topic: &str, kind: (&str, &str), qos: Qos) -> Result<Topic, Fault> {
        self.publish(topic, kind.0, &hashed(kind)?, qos)
    }

    /// Begins to answer calls. Each has a thread of its own, because an answer may take minutes.
    pub fn answer(
        &mut self,
        service: &str,
        kind: (&str, &str),
        answer: impl Fn(&[u8]) -> Answered + Send + Sync + 'static,
    ) -> Result<Service, Fault> {
        self.entities += 1;
        let (name, hash) = (self.place.topic(service), hashed(kind)?);
        let (answer, calls) = (Arc::new(answer), self.calls.clone());
        let queryable = self.session.declare_queryable(self.place.key(&name, kind.0, &hash)).complete(true);
        let queryable = queryable.callback(move |query| {
            let (answer, calls) = (answer.clone(), calls.clone());
            if calls.fetch_add(1, Ordering::Relaxed) >= MOST_CALLS {
                calls.fetch_sub(1, Ordering::Relaxed);
                refuses(&query, &format!("{MOST_CALLS} calls wait for their answers"));
                return;
            }
            let of_thread = calls.clone();
            let thread = std::thread::Builder::new().name("call".into()).spawn(move || {
                replies(&query, &*answer);
                of_thread.fetch_sub(1, Ordering::Relaxed);
            });
            // The call went with the thread that could not begin: who called gets no answer.
            if thread.is_err() {
                calls.fetch_sub(1, Ordering::Relaxed);
            }
        });
        let queryable = queryable.wait().map_err(lost)?;
        let token = self.place.entity(self.entities, Entity::Service, &name, kind.0, &hash, &SERVICE.words());
        let token = self.session.liveliness().declare_token(token).wait().map_err(lost)?;
        Ok(Service { _queryable: queryable, _token: token })
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

/// The hash of a type from its definition.
fn hashed((name, text): (&str, &str)) -> Result<String, Fault> {
    let definition = Definition::read(name, text.as_bytes());
    definition.map(|d| hash::of(&d)).map_err(|why| fault(why, "a fault of this program", "report it"))
}

/// Answers a call. An answer carries the number and the identity of its request, by which rmw_zenoh knows it again; a
/// request of plain Zenoh has none.
fn replies(query: &Query, answer: &impl Fn(&[u8]) -> Answered) {
    let request = query.payload().map(|p| p.to_bytes().into_owned()).unwrap_or_default();
    let bytes = match answer(&request) {
        Answered::Bytes(bytes) => bytes,
        Answered::Foreign(why) => return refuses(query, why),
    };
    let reply = query.reply(query.key_expr().clone(), bytes);
    // Who has gone gets no answer.
    let _ = match query.attachment().and_then(|a| asked(&a.to_bytes())) {
        Some((number, identity)) => {
            let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).unwrap_or_default();
            reply.attachment(&attachment(number, now.as_nanos() as i64, identity)[..]).wait()
        }
        None => reply.wait(),
    };
}

fn refuses(query: &Query, why: &str) {
    let _ = query.reply_err(why).wait();
}

/// Number and identity of a request.
fn asked(bytes: &[u8]) -> Option<(i64, [u8; 16])> {
    match bytes.len() == 33 && bytes[16] == 16 {
        true => Some((i64::from_le_bytes(bytes[..8].try_into().ok()?), bytes[17..].try_into().ok()?)),
        false => None,
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
        assert_eq!(asked(&bytes), Some((3, [9; 16])));
        assert_eq!((asked(&bytes[1..]), asked(&[0; 33]), asked(&[])), (None, None, None));
    }
}
