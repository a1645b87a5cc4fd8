//! In: a camera under control. Out: its frames as they arrive, from payloads of a picture or of several parts.
//! Frame and unit: the camera's clock in ticks.

use super::part_stream::PartStream;
use super::parts::{Block, Part};
use std::net::SocketAddr;
use std::time::Duration;
use viva_genicam::genapi::RegisterIo;
use viva_genicam::pfnc::PixelFormat;
use viva_genicam::{Camera, Frame, FrameStream, GenicamError, GigeRegisterIo, StreamOptions};

/// Bootstrap registers of the stream channel: destination port and address, capabilities, configuration.
const PORT: u64 = 0x0d00;
const ADDRESS: u64 = 0x0d18;
const CAN: u64 = 0x0d20;
const DOES: u64 = 0x0d24;
/// The bit of multi-part payloads in capabilities and configuration.
const MULTI_PART: u32 = 1 << 6;

/// Where frames come from.
pub enum Delivery {
    /// Payloads of one picture.
    Pictures(FrameStream),
    /// Payloads of several parts; the one with this pixel format is the frame.
    Parts(PartStream, String),
}

/// What arrived.
pub enum Got {
    /// A frame; an incomplete one says so.
    Frame(Frame),
    /// The number of a frame that cannot be used, and why.
    Broken(u64, String),
    /// Nothing within the time.
    Nothing,
    /// No more will arrive.
    Ended(String),
}

/// Whether the camera can send payloads of several parts, by its registers. Cameras from before GigE Vision 2.1 do not
/// have them.
pub fn sends_parts(camera: &Camera<GigeRegisterIo>) -> bool {
    register(camera, CAN).is_ok_and(|can| can & MULTI_PART != 0)
}

fn register(camera: &Camera<GigeRegisterIo>, at: u64) -> Result<u32, GenicamError> {
    let bytes = camera.transport().read(at, 4)?;
    Ok(bytes.iter().fold(0, |word, b| word << 8 | u32::from(*b)))
}

/// Tells a camera that can send payloads of several parts whether they are understood.
fn announce(camera: &Camera<GigeRegisterIo>, parts: bool) -> Result<(), GenicamError> {
    if sends_parts(camera) {
        let does = register(camera, DOES)? & !MULTI_PART | if parts { MULTI_PART } else { 0 };
        camera.transport().write(DOES, &does.to_be_bytes())?;
    }
    Ok(())
}

impl Delivery {
    /// Tells the camera where to send. `parts`: the pixel format of the wanted part if it sends several.
    ///
    /// # Errors
    /// The camera refuses, or the system gives no socket.
    pub fn open(
        camera: &mut Camera<GigeRegisterIo>,
        options: StreamOptions,
        parts: Option<&str>,
    ) -> Result<Delivery, GenicamError> {
        let mut pictures = camera.open_stream(options)?;
        let params = pictures.params();
        let (Some(format), Some(SocketAddr::V4(there))) = (parts, params.camera) else {
            // A former program may have left it set.
            announce(camera, false)?;
            pictures.set_deliver_incomplete(true);
            return Ok(Delivery::Pictures(pictures));
        };
        // The packet size that was agreed on remains in the camera.
        drop(pictures);
        let stream = PartStream::open(params.host, *there.ip())
            .and_then(|stream| Ok((stream.port()?, stream)))
            .map_err(|source| GenicamError::Network { during: "open a socket for parts", source });
        let (port, stream) = stream?;
        camera.transport().write(ADDRESS, &params.host.octets())?;
        camera.transport().write(PORT, &u32::from(port).to_be_bytes())?;
        announce(camera, true)?;
        Ok(Delivery::Parts(stream, format.to_owned()))
    }

    /// The next frame.
    pub fn next(&mut self, within: Duration) -> Got {
        match self {
            Delivery::Pictures(stream) => match stream.next_frame_blocking(within) {
                Ok(Some(frame)) => Got::Frame(frame),
                Ok(None) => Got::Ended("the stream ended".into()),
                Err(GenicamError::Timeout(_)) => Got::Nothing,
                Err(e) => Got::Ended(e.to_string()),
            },
            Delivery::Parts(stream, format) => match stream.next(within) {
                Ok(Some(Block::Whole(id, ticks, parts))) => match wanted(parts, format) {
                    Ok(mut frame) => {
                        (frame.block_id, frame.ts_dev) = (id, Some(ticks));
                        Got::Frame(frame)
                    }
                    Err(why) => Got::Broken(id, why),
                },
                Ok(Some(Block::Broken(id, why))) => Got::Broken(id, why),
                Ok(None) => Got::Nothing,
                Err(e) => Got::Ended(e.to_string()),
            },
        }
    }

    /// Packets that were lost and came when they were asked for.
    pub fn resent(&self) -> u64 {
        match self {
            Delivery::Pictures(stream) => stream.stats().resend_recovered,
            Delivery::Parts(stream, _) => stream.resent(),
        }
    }

    /// Number of packets of another payload, if nothing else arrived.
    pub fn foreign(&self) -> Option<u64> {
        let n = match self {
            Delivery::Pictures(stream) => {
                let seen = stream.stats();
                if seen.frames_complete + seen.frames_incomplete > 0 {
                    return None;
                }
                seen.packets_ignored_unsupported
            }
            Delivery::Parts(stream, _) => stream.foreign(),
        };
        Some(n).filter(|n| *n > 0)
    }
}

/// The one part with this pixel format, as a frame.
fn wanted(parts: Vec<Part>, format: &str) -> Result<Frame, String> {
    let name = |part: &Part| PixelFormat::from_code(part.code).name();
    let names: Vec<String> = parts.iter().map(|p| name(p).map_or(format!("{:#010x}", p.code), str::to_owned)).collect();
    let mut found = parts.into_iter().filter(|part| name(part) == Some(format));
    let (Some(part), None) = (found.next(), found.next()) else {
        return Err(format!("has the parts {}, one of {format} is wanted", names.join(", ")));
    };
    let [width, height] = part.size;
    let mut frame = Frame::new(part.bytes.into(), width, height, PixelFormat::from_code(part.code));
    frame.padding_x = part.padding;
    Ok(frame)
}
