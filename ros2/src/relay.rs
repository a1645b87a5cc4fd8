//! In: the records of a stream. Out: its messages at the door, each on the topic of its channel; what cannot be sent is
//! told once for each channel.
//! Frame and unit: ns.

use super::definition::Definition;
use super::door::{Door, Topic};
use super::fault::{Fault, fault};
use super::names::is_name;
use super::pace::Pace;
use super::qos::Qos;
use super::stream::{Stream, shown};
use super::{cdr, hash};
use mcap::records::{Channel, MessageHeader, Record, SchemaHeader};
use std::collections::BTreeMap;
use std::time::{Duration, Instant};

/// Most schemas and most channels.
const MOST: usize = 1000;
/// Time between two looks at the router.
const LOOK: Duration = Duration::from_secs(1);

/// A channel that is relayed.
struct Open {
    name: String,
    kind: String,
    definition: Definition,
    topic: Topic,
    /// Messages that are not of their type.
    wrong: u64,
}

/// Messages of a topic.
pub struct Count {
    pub topic: String,
    pub kind: String,
    pub sent: i64,
}

/// What was relayed.
#[derive(Default)]
pub struct Account {
    pub counts: Vec<Count>,
    /// Messages that were not sent: of channels that are not relayed, and such that are not of their type.
    pub skipped: u64,
    pub wrong: u64,
}

pub struct Relay<'a> {
    door: &'a mut Door,
    pace: Option<Pace>,
    stop: &'a dyn Fn() -> bool,
    schemas: BTreeMap<u16, (SchemaHeader, Vec<u8>)>,
    channels: BTreeMap<u16, (Channel, Option<Open>)>,
    skipped: u64,
    looked: Instant,
    /// Time to wait before the first message.
    delay: Duration,
    ended: bool,
}

impl<'a> Relay<'a> {
    /// Without `pace` messages are sent as they arrive.
    pub fn new(door: &'a mut Door, pace: Option<Pace>, delay: f64, stop: &'a dyn Fn() -> bool) -> Relay<'a> {
        let delay = Duration::from_secs_f64(delay);
        Relay {
            door,
            pace,
            stop,
            schemas: BTreeMap::new(),
            channels: BTreeMap::new(),
            skipped: 0,
            looked: Instant::now(),
            delay,
            ended: false,
        }
    }

    /// Relays the stream to its end. The account is right also if it fails. The topics stand until they are dropped.
    pub fn run(mut self, stream: &mut Stream) -> (Account, Result<(), Fault>, Vec<Topic>) {
        let name = stream.name().to_owned();
        let stop = self.stop;
        let mut went = Ok(true);
        while matches!(went, Ok(true)) {
            went = stream.next(stop, &mut |record| self.take(record, &name));
        }
        let mut topics = Vec::new();
        let mut account = Account { skipped: self.skipped, ..Account::default() };
        for open in self.channels.into_values().filter_map(|(_, open)| open) {
            account.wrong += open.wrong;
            account.counts.push(Count { topic: open.name, kind: open.kind, sent: open.topic.sent() });
            topics.push(open.topic);
        }
        (account, went.map(|_| ()), topics)
    }

    fn take(&mut self, record: Record, name: &str) -> Result<(), Fault> {
        // Behind the messages a file repeats its schemas and channels.
        match record {
            _ if self.ended => Ok(()),
            Record::DataEnd(_) => {
                self.ended = true;
                Ok(())
            }
            Record::Header(header) if header.profile != "ros2" => Err(fault(
                format!("{name}: its profile is '{}', 'ros2' is wanted", shown(&header.profile)),
                "a file of another program, whose messages are not those of ROS 2",
                "give a file of sheetlight mcap, sheetlight live --mcap or ros2 bag",
            )),
            Record::Schema { header, data } => self.schema(header, &data, name),
            Record::Channel(channel) => self.channel(channel, name),
            Record::Message { header, data } => self.message(&header, &data, name),
            _ => Ok(()),
        }
    }

    fn schema(&mut self, header: SchemaHeader, data: &[u8], name: &str) -> Result<(), Fault> {
        let new = !self.schemas.contains_key(&header.id);
        if new && self.schemas.len() == MOST {
            return Err(too_many(name, "schemas"));
        }
        // What is too long is refused with its channel; a byte more than the limit shows that it is.
        let kept = &data[..data.len().min(super::definition::MOST_BYTES + 1)];
        self.schemas.insert(header.id, (header, kept.to_vec()));
        Ok(())
    }

    fn channel(&mut self, channel: Channel, name: &str) -> Result<(), Fault> {
        if let Some((before, _)) = self.channels.get(&channel.id) {
            if *before == channel {
                return Ok(());
            }
            return Err(fault(
                format!(
                    "{name}: channel {} is '{}' and then '{}'",
                    channel.id,
                    shown(&before.topic),
                    shown(&channel.topic)
                ),
                "the file is damaged, or two files were joined",
                "join files with mcap merge",
            ));
        }
        if self.channels.len() == MOST {
            return Err(too_many(name, "channels"));
        }
        let open = match self.readable(&channel) {
            Ok(definition) => Some(self.open(&channel, definition)?),
            Err(why) => {
                eprintln!("{} is not sent: {}", shown(&channel.topic), shown(&why));
                None
            }
        };
        self.channels.insert(channel.id, (channel, open));
        Ok(())
    }

    /// The type of a channel's messages; an error says in words why they cannot be sent.
    fn readable(&self, channel: &Channel) -> Result<Definition, String> {
        if !is_name(&channel.topic) {
            return Err("its name is not one of ROS 2".into());
        }
        if channel.message_encoding != "cdr" {
            return Err(format!("its messages are '{}', 'cdr' is wanted", shown(&channel.message_encoding)));
        }
        let (schema, text) =
            self.schemas.get(&channel.schema_id).ok_or_else(|| format!("schema {} is missing", channel.schema_id))?;
        if schema.encoding != "ros2msg" {
            return Err(format!("its schema is '{}', 'ros2msg' is wanted", shown(&schema.encoding)));
        }
        Definition::read(&schema.name, text)
    }

    fn open(&mut self, channel: &Channel, definition: Definition) -> Result<Open, Fault> {
        let qos = Qos::read(channel.metadata.get("offered_qos_profiles").map_or("", String::as_str));
        let (kind, hash) = (definition.name.clone(), hash::of(&definition));
        let topic = self.door.publish(&channel.topic, &kind, &hash, qos)?;
        Ok(Open { name: self.door.name(&channel.topic), kind, definition, topic, wrong: 0 })
    }

    fn message(&mut self, header: &MessageHeader, data: &[u8], name: &str) -> Result<(), Fault> {
        let stop = self.stop;
        let until = Instant::now() + std::mem::take(&mut self.delay);
        while Instant::now() < until && !stop() {
            std::thread::sleep(Duration::from_millis(20));
        }
        if self.pace.as_mut().is_some_and(|pace| !pace.wait(header.log_time, stop)) {
            return Ok(());
        }
        if self.looked.elapsed() > LOOK {
            self.looked = Instant::now();
            self.door.look();
        }
        let Some((channel, open)) = self.channels.get_mut(&header.channel_id) else {
            return Err(fault(
                format!("{name}: a message is of channel {}, which is missing", header.channel_id),
                "the file is damaged",
                "what stands before was sent; repair the file with mcap recover",
            ));
        };
        let Some(open) = open else {
            self.skipped += 1;
            return Ok(());
        };
        if let Err(why) = cdr::check(data, &open.definition) {
            if open.wrong == 0 {
                eprintln!("{}: message {} is no {}: {}", channel.topic, header.sequence, open.kind, shown(&why));
            }
            open.wrong += 1;
            return Ok(());
        }
        open.topic.send(data)
    }
}

fn too_many(name: &str, what: &str) -> Fault {
    fault(format!("{name}: more than {MOST} {what}"), "the file is damaged", "repair the file with mcap recover")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::Options;
    use clap::Parser;
    use std::io::Cursor;

    /// A session that listens for nobody.
    fn door() -> Door {
        let port = std::net::TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap().port();
        let listen = format!("tcp/127.0.0.1:{port}");
        Door::open(&Options::parse_from(["sheetlight-ros2", "-", "--listen", &listen]), 0).unwrap()
    }

    /// A file with two topics, small chunks and 20 messages.
    fn file() -> Vec<u8> {
        let mut bytes = Vec::new();
        let options = mcap::WriteOptions::new().compression(None).profile("ros2").chunk_size(Some(200));
        let mut writer = options.create(Cursor::new(&mut bytes)).unwrap();
        let text = writer.add_schema("std_msgs/msg/String", "ros2msg", b"string data\n").unwrap();
        let nested = b"Part[] parts\n===\nMSG: a/Part\nfloat64[3] x\nstring s\n";
        let parts = writer.add_schema("a/msg/Parts", "ros2msg", nested).unwrap();
        let kept = BTreeMap::from([("offered_qos_profiles".to_owned(), "- durability: 1\n  depth: 2\n".to_owned())]);
        let text = writer.add_channel(text, "/text", "cdr", &kept).unwrap();
        let parts = writer.add_channel(parts, "/parts", "cdr", &BTreeMap::new()).unwrap();
        let one: &[u8] = &[&[0, 1, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0][..], &[0; 24], &[2, 0, 0, 0, b'x', 0]].concat();
        for sequence in 0..20 {
            let (channel_id, data) =
                if sequence % 2 == 0 { (text, &[0, 1, 0, 0, 2, 0, 0, 0, b'x', 0][..]) } else { (parts, one) };
            let header = MessageHeader { channel_id, sequence, log_time: 5, publish_time: 5 };
            writer.write_to_known_channel(&header, data).unwrap();
        }
        writer.finish().unwrap();
        drop(writer);
        bytes
    }

    fn relayed(door: &mut Door, bytes: Vec<u8>) -> (i64, Account, Result<(), Fault>) {
        let mut stream = Stream::of("test".into(), Box::new(Cursor::new(bytes))).unwrap();
        let (account, went, _) = Relay::new(door, None, 0.0, &|| false).run(&mut stream);
        (account.counts.iter().map(|c| c.sent).sum(), account, went)
    }

    #[test]
    fn a_whole_file_is_relayed_and_a_cut_one_up_to_its_end() {
        let (mut door, file) = (door(), file());
        let (sent, account, went) = relayed(&mut door, file.clone());
        assert!(went.is_ok() && sent == 20 && account.wrong == 0 && account.skipped == 0, "{sent} {went:?}");
        let mut before = 0;
        for end in 0..file.len() {
            let (sent, _, went) = relayed(&mut door, file[..end].to_vec());
            assert!(went.is_err() && sent >= before, "cut at {end}: {sent} after {before}, {went:?}");
            before = sent;
        }
        assert_eq!(before, 20);
    }

    /// The most memory that this program has used, bytes.
    fn memory() -> u64 {
        let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
        let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:")).unwrap_or("0 kB").trim();
        line.trim_end_matches(" kB").parse::<u64>().unwrap_or(0) * 1024
    }

    /// 1,000 files with 1 to 4 changed bytes, and 1,000 whose checksums were left out, so that the changes get further.
    #[test]
    fn changed_files_do_no_harm() {
        let (mut door, file) = (door(), file());
        let mut state = 1u64;
        let mut random = |below: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % below
        };
        let sums = checksums(&file);
        let (mut whole, mut refused, mut wrong) = (0, 0, 0);
        for round in 0..2000 {
            let mut bytes = file.clone();
            if round >= 1000 {
                sums.iter().for_each(|at| bytes[*at..at + 4].fill(0));
            }
            for _ in 0..=random(4) {
                let at = random(bytes.len());
                bytes[at] = [0, 1, 0x7f, 0xff, random(256) as u8][random(5)];
            }
            let (_, account, went) = relayed(&mut door, bytes);
            match went {
                Ok(()) => whole += 1,
                Err(fault) => {
                    assert!(!fault.what.is_empty() && fault.what.len() < 300, "{}", fault.what);
                    refused += 1;
                }
            }
            wrong += account.wrong;
        }
        assert!(whole > 100 && refused > 500 && wrong > 40, "{whole} {refused} {wrong}");
        assert!(memory() < 400 << 20, "{} bytes of memory", memory());
    }

    /// Places of the checksums of chunks: behind their start, end and length.
    fn checksums(file: &[u8]) -> Vec<usize> {
        let (mut at, mut places) = (8, Vec::new());
        while at + 9 < file.len() {
            if file[at] == mcap::records::op::CHUNK {
                places.push(at + 9 + 24);
            }
            at += 9 + u64::from_le_bytes(file[at + 1..at + 9].try_into().unwrap()) as usize;
        }
        places
    }
}
