//! In: a task, pictures, points. Out: the bytes between the driver and an entry (docs/benchmark.md, "What an entry
//! reads and writes"). Frame and unit: px, camera frame in mm; numbers are little-endian.

use sheetlight::fault::{Fault, Result};
use sheetlight::raster::{Image, Pixels};
use std::io::{ErrorKind, Read, Write};

/// Version of the format.
pub(super) const FORMAT: u32 = 1;
/// Most points that an entry may return for one picture; more are a sign of lost synchronisation.
const MOST_POINTS: u32 = 1 << 22;

/// How the driver sends the pictures.
#[derive(
    Clone,
    Copy,
    Debug,
    PartialEq,
    Eq,
    serde::Serialize,
    serde::Deserialize,
    strum::EnumString,
    strum::IntoStaticStr,
    strum::VariantArray,
)]
#[serde(rename_all = "lowercase")]
#[strum(serialize_all = "lowercase", parse_err_ty = String, parse_err_fn = unknown)]
pub enum Scenario {
    /// The next picture is sent when the points of the last one have arrived.
    Single,
    /// All pictures are sent as fast as the entry takes them.
    Offline,
    /// Pictures come at a fixed rate. One that is due while two others wait is dropped.
    Camera,
    /// As `Offline`, with four processes of the entry at once.
    Streams,
}

fn unknown(word: &str) -> String {
    sheetlight::fault::unknown::<Scenario>("scenario", word)
}

impl Scenario {
    /// The name in options and files.
    pub fn name(self) -> &'static str {
        self.into()
    }
}

/// Brown-Conrady lens and pinhole; px.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct CameraHeader {
    pub fx: f64,
    pub fy: f64,
    pub cx: f64,
    pub cy: f64,
    /// k1, k2, p1, p2, k3 in OpenCV's order.
    pub distortion: [f64; 5],
}

/// The laser plane `normal · X = offset_mm`, camera frame.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct PlaneHeader {
    pub normal: [f64; 3],
    pub offset_mm: f64,
}

/// The first line that an entry reads, as JSON. Entries ignore keys that they do not know.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub(super) struct Header {
    pub sheetlight_bench: u32,
    pub width: u32,
    pub height: u32,
    pub bits: u8,
    pub scenario: Scenario,
    pub camera: CameraHeader,
    pub plane: PlaneHeader,
}

impl Header {
    /// Bytes of one picture.
    pub fn picture_bytes(&self) -> usize {
        self.width as usize * self.height as usize * if self.bits == 8 { 1 } else { 2 }
    }
}

/// The first line that an entry writes, as JSON.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Hello {
    /// Name of the program.
    pub name: String,
    /// Its version.
    #[serde(default)]
    pub version: String,
    /// Settings in words.
    #[serde(default)]
    pub settings: String,
}

/// One point of an entry.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    /// Position in the picture, px; 0 is the middle of the first column or row.
    pub u: f32,
    pub v: f32,
    /// Standard deviation across the stripe, px; NaN if the entry states none.
    pub sigma_px: f32,
    /// Camera frame, mm.
    pub xyz: [f32; 3],
}

/// Bytes of a picture as they are sent: its number, then its rows.
pub(super) fn picture_bytes(image: &Image) -> Vec<u8> {
    match &image.pixels {
        Pixels::U8(px) => px.clone(),
        Pixels::U16(px) => px.iter().flat_map(|v| v.to_le_bytes()).collect(),
    }
}

/// The picture of these bytes.
pub(super) fn picture(header: &Header, bytes: Vec<u8>) -> Image {
    if header.bits == 8 {
        Image::from_u8(header.width, header.height, bytes)
    } else {
        let px = bytes.chunks_exact(2).map(|b| u16::from_le_bytes([b[0], b[1]])).collect();
        Image::from_u16(header.width, header.height, header.bits, px)
    }
}

/// Reads the next picture: its number and its bytes; `None` at the end of the input.
pub(super) fn read_picture(input: &mut impl Read, bytes: usize) -> Result<Option<(u32, Vec<u8>)>> {
    let mut number = [0; 4];
    match input.read_exact(&mut number) {
        Err(e) if e.kind() == ErrorKind::UnexpectedEof => return Ok(None),
        other => other.map_err(lost)?,
    }
    let mut pixels = vec![0; bytes];
    input.read_exact(&mut pixels).map_err(lost)?;
    Ok(Some((u32::from_le_bytes(number), pixels)))
}

/// Writes the points of a picture.
pub(super) fn write_points(output: &mut impl Write, number: u32, points: &[Found]) -> Result<()> {
    let mut bytes = Vec::with_capacity(8 + 24 * points.len());
    bytes.extend(number.to_le_bytes());
    bytes.extend((points.len() as u32).to_le_bytes());
    for p in points {
        let [x, y, z] = p.xyz;
        bytes.extend([p.u, p.v, p.sigma_px, x, y, z].iter().flat_map(|n| n.to_le_bytes()));
    }
    output.write_all(&bytes).map_err(lost)?;
    output.flush().map_err(lost)
}

/// Reads the points of a picture: its number and the points; `None` at the end of the output.
pub(super) fn read_points(output: &mut impl Read) -> std::result::Result<Option<(u32, Vec<Found>)>, String> {
    let mut head = [0; 8];
    match output.read(&mut head[..1]) {
        Ok(0) => return Ok(None),
        Ok(_) => output.read_exact(&mut head[1..]).map_err(|e| format!("its output ends within a reply ({e})"))?,
        Err(e) => return Err(e.to_string()),
    }
    let word = |b: &[u8]| u32::from_le_bytes([b[0], b[1], b[2], b[3]]);
    let (number, count) = (word(&head), word(&head[4..]));
    if count > MOST_POINTS {
        let text = text_in(&head);
        return Err(format!("it announces {count} points for picture {number}, {MOST_POINTS} is the limit{text}"));
    }
    let mut bytes = vec![0; 24 * count as usize];
    output.read_exact(&mut bytes).map_err(|e| format!("its output ends within {count} points ({e})"))?;
    let float = |b: &[u8], i: usize| f32::from_bits(word(&b[4 * i..]));
    let point = |b: &[u8]| Found {
        u: float(b, 0),
        v: float(b, 1),
        sigma_px: float(b, 2),
        xyz: [float(b, 3), float(b, 4), float(b, 5)],
    };
    Ok(Some((number, bytes.chunks_exact(24).map(point).collect())))
}

/// A remark if the bytes are letters: a program that prints has lost its place in the format.
fn text_in(bytes: &[u8]) -> String {
    let text = bytes.iter().all(|b| b.is_ascii_graphic() || b.is_ascii_whitespace());
    if text { format!("; these bytes are text: {:?}", String::from_utf8_lossy(bytes)) } else { String::new() }
}

/// What the number of a picture that was not sent says: letters in its place, or an answer of the wrong length.
pub(super) fn astray(number: u32, next: u32) -> String {
    let text = text_in(&number.to_le_bytes());
    let long = if text.is_empty() && number.wrapping_sub(next) > 1 << 16 {
        "; the answer before has too many or too few bytes, or a type other than f32"
    } else {
        ""
    };
    format!("it answered picture {number} where {next} was next{text}{long}")
}

/// The other side closed the pipe.
pub(super) fn lost(e: std::io::Error) -> Fault {
    Fault::input(format!("bench entry: the other program's pipe failed ({e})"))
        .cause("the other program ended, or speaks another version of the format")
        .next("run it through sheetlight bench run, and read what it wrote to stderr")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(u: f32) -> Found {
        Found { u, v: 2.5, sigma_px: f32::NAN, xyz: [1.0, -2.0, 300.0] }
    }

    #[test]
    fn points_come_back_as_they_were_written() {
        let mut bytes = Vec::new();
        write_points(&mut bytes, 7, &[point(1.25), point(-3.0)]).unwrap();
        write_points(&mut bytes, 8, &[]).unwrap();
        assert_eq!(bytes.len(), 8 + 48 + 8);
        let mut read = &bytes[..];
        let (number, points) = read_points(&mut read).unwrap().unwrap();
        assert_eq!((number, points.len(), points[0].u, points[1].u), (7, 2, 1.25, -3.0));
        assert!(points[0].sigma_px.is_nan() && points[0].xyz == [1.0, -2.0, 300.0]);
        assert_eq!(read_points(&mut read).unwrap().unwrap(), (8, vec![]));
        assert_eq!(read_points(&mut read).unwrap(), None);
    }

    #[test]
    fn a_reply_that_is_cut_or_too_long_is_named() {
        let mut bytes = Vec::new();
        write_points(&mut bytes, 7, &[point(1.0)]).unwrap();
        for cut in 1..bytes.len() {
            assert!(read_points(&mut &bytes[..cut]).unwrap_err().contains("ends within"), "{cut}");
        }
        bytes[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
        assert!(read_points(&mut &bytes[..]).unwrap_err().contains("4294967295 points"));
        let printed = read_points(&mut &b"found 12 points"[..]).unwrap_err();
        assert!(printed.contains("these bytes are text: \"found 12\""), "{printed}");
        assert!(astray(u32::from_le_bytes(*b"4 32"), 1).contains("text: \"4 32\""));
        assert!(astray(0x3f80_0000, 1).contains("too many or too few bytes"));
        assert_eq!(astray(7, 1), "it answered picture 7 where 1 was next");
    }

    #[test]
    fn a_picture_of_twelve_bits_takes_two_bytes_a_pixel() {
        let image = Image::from_u16(2, 1, 12, vec![0x0102, 4095]);
        let bytes = picture_bytes(&image);
        assert_eq!(bytes, [2, 1, 255, 15]);
        let header = super::super::scene::Task::example(2, 1, 12).header(Scenario::Offline);
        assert_eq!((header.picture_bytes(), picture(&header, bytes).get(1, 0)), (4, 4095));
        let mut stream: &[u8] = &[9, 0, 0, 0, 2, 1, 255, 15];
        assert_eq!(read_picture(&mut stream, 4).unwrap().unwrap(), (9, vec![2, 1, 255, 15]));
        assert!(read_picture(&mut stream, 4).unwrap().is_none());
    }
}
