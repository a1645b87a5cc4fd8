//! In: messages with topic and time. Out: an MCAP file of profile ros2 with these messages and their index, or a
//! stream.
//! Frame and unit: none.

use super::cdr::Cdr;
use super::definitions::Kind;
use super::messages::Stamp;
use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{McapError, WriteOptions, Writer};
use sheetlight::fault::{Fault, Result};
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::File;
use std::io::{BufWriter, ErrorKind, Seek, Write};
use std::path::{Path, PathBuf};

/// Topics of the messages.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Topic {
    /// Points of a shot.
    Profile,
    /// All points.
    Cloud,
    /// Poses of the frames at a shot.
    Transforms,
    /// Poses of frames that never change.
    Static,
    /// Picture of a shot.
    Picture,
    /// Camera of a picture.
    CameraInfo,
    /// Pose of a found part.
    Part,
    /// Figures of the scan.
    Diagnostics,
}

impl Topic {
    /// Name for subscribers.
    pub fn name(self) -> &'static str {
        match self {
            Topic::Profile => "/sheetlight/profile",
            Topic::Cloud => "/sheetlight/cloud",
            Topic::Transforms => "/tf",
            Topic::Static => "/tf_static",
            Topic::Picture => "/sheetlight/picture",
            Topic::CameraInfo => "/sheetlight/camera_info",
            Topic::Part => "/sheetlight/part",
            Topic::Diagnostics => "/diagnostics",
        }
    }

    /// Kind of its messages.
    pub fn kind(self) -> Kind {
        match self {
            Topic::Profile | Topic::Cloud => Kind::PointCloud,
            Topic::Transforms | Topic::Static => Kind::Transforms,
            Topic::Picture => Kind::Image,
            Topic::CameraInfo => Kind::CameraInfo,
            Topic::Part => Kind::Pose,
            Topic::Diagnostics => Kind::Diagnostics,
        }
    }

    /// Settings with which a player of bags offers the topic, in the numbers of ROS 2's middleware. All messages are
    /// kept in order (reliable), and those sent once also reach later subscribers (durability 1, transient local).
    fn quality_of_service(self) -> String {
        let (depth, durability) = match self {
            Topic::Static | Topic::Cloud | Topic::Part | Topic::Diagnostics => (1, 1),
            _ => (100, 2),
        };
        let never = "{sec: 0, nsec: 0}";
        format!(
            "- history: 1\n  depth: {depth}\n  reliability: 1\n  durability: {durability}\n  deadline: {never}\n  \
             lifespan: {never}\n  liveliness: 1\n  liveliness_lease_duration: {never}\n  \
             avoid_ros_namespace_conventions: false\n"
        )
    }
}

/// Size of messages, bytes, after which a chunk is closed: a reader loads one chunk at a time.
const CHUNK: u64 = 4 << 20;

/// A topic in the file.
struct Channel {
    id: u16,
    messages: u32,
}

/// A buffer before a file or a pipe.
trait Target: Write + Seek {}

impl<T: Write + Seek> Target for T {}

/// Bytes of messages that wait for the file or pipe.
const BUFFER: usize = 1 << 20;

/// The file during writing. Messages are written to the disk as they come; chunks are not compressed.
pub struct Bag<'a> {
    path: PathBuf,
    writer: Writer<Box<dyn Target + 'a>>,
    channels: BTreeMap<Topic, Channel>,
}

fn options() -> WriteOptions {
    let library = format!("sheetlight {}", env!("CARGO_PKG_VERSION"));
    WriteOptions::new().compression(None).profile("ros2").library(library)
}

impl<'a> Bag<'a> {
    /// Begins a file; `path` is its name in errors.
    ///
    /// # Errors
    /// The file cannot be written. The other functions here fail only for this reason.
    pub fn new(file: &'a File, path: &Path) -> Result<Bag<'a>> {
        let target: Box<dyn Target + 'a> = Box::new(BufWriter::with_capacity(BUFFER, file));
        Bag::begun(options().chunk_size(Some(CHUNK)), target, path)
    }

    /// Begins a stream, which nobody reads twice: it has no chunks and no index, so that no memory grows with it.
    /// [`Bag::flush`] hands on what was written.
    pub fn stream(pipe: impl Write + 'a, name: &Path) -> Result<Bag<'a>> {
        let target: Box<dyn Target + 'a> = Box::new(NoSeek::new(BufWriter::with_capacity(BUFFER, pipe)));
        Bag::begun(options().use_chunks(false), target, name)
    }

    fn begun(options: WriteOptions, target: Box<dyn Target + 'a>, path: &Path) -> Result<Bag<'a>> {
        let writer = options.create(target).map_err(|e| fault(path, e))?;
        Ok(Bag { path: path.to_owned(), writer, channels: BTreeMap::new() })
    }

    /// Hands everything on that was written. False if nobody reads it any more.
    pub fn flush(&mut self) -> Result<bool> {
        match self.writer.flush() {
            Ok(()) => Ok(true),
            Err(McapError::Io(e)) if e.kind() == ErrorKind::BrokenPipe => Ok(false),
            Err(e) => Err(fault(&self.path, e)),
        }
    }

    /// Adds a metadata record of texts.
    pub fn metadata(&mut self, name: &str, texts: BTreeMap<String, String>) -> Result<()> {
        let record = Metadata { name: name.to_owned(), metadata: texts };
        self.writer.write_metadata(&record).map_err(|e| fault(&self.path, e))
    }

    fn channel(&mut self, topic: Topic) -> std::result::Result<&mut Channel, McapError> {
        if !self.channels.contains_key(&topic) {
            let kind = topic.kind();
            let schema = self.writer.add_schema(kind.name(), "ros2msg", kind.definition().as_bytes())?;
            let told = BTreeMap::from([("offered_qos_profiles".to_owned(), topic.quality_of_service())]);
            let id = self.writer.add_channel(schema, topic.name(), "cdr", &told)?;
            self.channels.insert(topic, Channel { id, messages: 0 });
        }
        Ok(self.channels.get_mut(&topic).expect("just added"))
    }

    /// Adds a message; its time is also the log time.
    pub fn write(&mut self, topic: Topic, at: Stamp, message: &Cdr) -> Result<()> {
        let path = self.path.clone();
        let channel = self.channel(topic).map_err(|e| fault(&path, e))?;
        let header =
            MessageHeader { channel_id: channel.id, sequence: channel.messages, log_time: at.0, publish_time: at.0 };
        channel.messages += 1;
        self.writer.write_to_known_channel(&header, message.bytes()).map_err(|e| fault(&path, e))
    }

    /// Writes the index. Returns the number of messages by topic.
    pub fn finish(mut self) -> Result<BTreeMap<Topic, u32>> {
        self.writer.finish().map_err(|e| fault(&self.path, e))?;
        let counts = self.channels.iter().map(|(topic, c)| (*topic, c.messages)).collect();
        self.writer.into_inner().flush().map_err(|e| Fault::write(&self.path, e))?;
        Ok(counts)
    }
}

/// Takes the operating system's error as the cause, however deep it is wrapped.
fn fault(path: &Path, error: McapError) -> Fault {
    let McapError::Io(error) = error else {
        return Fault::output(format!("{}: cannot be written: {error}", path.display()))
            .cause("a fault of this program")
            .next("report it with the scan's scan.json");
    };
    let mut inner: Option<&(dyn Error + 'static)> = Some(&error);
    while let Some(e) = inner {
        if e.downcast_ref::<std::io::Error>().is_some_and(|e| e.kind() == ErrorKind::StorageFull) {
            return Fault::write(path, ErrorKind::StorageFull.into());
        }
        let held = e.downcast_ref::<std::io::Error>().and_then(|e| e.get_ref());
        inner = held.map(|e| e as &(dyn Error + 'static)).or_else(|| e.source());
    }
    Fault::write(path, error)
}
