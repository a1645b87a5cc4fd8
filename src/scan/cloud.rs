//! In: points as they leave the scanner, shot by shot. Out: a binary PLY that grows on disk, can be resumed after a
//! crash, and gets its final name only when it is complete. Such a file can be read again.
//! Frame and unit: the frame that the header names, mostly the robot's base, mm; (u, v) in pixels of the shot; byte
//! layout in docs/file-formats.md.
//! layout in docs/file-formats.md.

use crate::fault::{Fault, Result};
use crate::files::{moment, remove};
use crate::geometry::Vec3;
use std::fs::File;
use std::io::{BufWriter, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

/// One measured point. Its memory layout is that of the PLY's record, little endian.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct CloudPoint {
    /// Position in the cloud's frame, mm.
    pub position: glam::Vec3,
    /// Standard deviation of the position along its worst direction, mm.
    pub sigma_mm: f32,
    /// Stripe amplitude, grey levels of the recording's depth.
    pub intensity: f32,
    /// Quality from 0 (barely credible) to 1.
    pub quality: f32,
    /// Index of the shot in the recording.
    pub shot: u32,
    /// Sub-pixel column of the peak in that shot, px.
    pub u: f32,
    /// Sub-pixel row of the peak in that shot, px.
    pub v: f32,
}

// Points are read and written with their memory layout, and the file is little endian.
const _: () = assert!(cfg!(target_endian = "little"), "clouds are read and written on little-endian machines only");

impl CloudPoint {
    /// Its position in the cloud's frame, mm.
    pub fn at(&self) -> Vec3 {
        Vec3::from(self.position.as_dvec3().to_array())
    }

    /// The same point at another position.
    pub fn moved_to(self, at: Vec3) -> CloudPoint {
        CloudPoint { position: glam::DVec3::from_array(at.into()).as_vec3(), ..self }
    }
}

const RECORD: u64 = size_of::<CloudPoint>() as u64;
/// The count is written in this many characters so that it can be replaced in place.
const COUNT_DIGITS: usize = 20;
/// Type of `shot` in the header. Open3D's tensor reader knows `int`, but leaves out a property of the type `uint`,
/// which files of before had.
const SHOT: &str = "int";
const EARLIER_SHOT: &str = "uint";
const PROPERTIES: [(&str, &str); 9] = [
    ("float", "x"),
    ("float", "y"),
    ("float", "z"),
    ("float", "sigma_mm"),
    ("float", "intensity"),
    ("float", "quality"),
    (SHOT, "shot"),
    ("float", "u"),
    ("float", "v"),
];
/// Points read or written at a time: 2.3 MB.
const CHUNK: usize = 1 << 16;

/// Frames that a cloud may be in: those of [`crate::recording::Motion::frame`], and that of an imported map.
const FRAMES: [&str; 4] = ["base", "axis", "flange", "map"];

fn header(count: u64, frame: &str) -> String {
    // Leading zeros, not spaces: every PLY reader parses them as part of a number.
    let mut text = format!("ply\nformat binary_little_endian 1.0\ncomment sheetlight cloud, {frame} frame, mm\n");
    text += &format!("element vertex {count:0COUNT_DIGITS$}\n");
    for (kind, name) in PROPERTIES {
        text += &format!("property {kind} {name}\n");
    }
    text + "end_header\n"
}

/// The same header as it was written before.
fn earlier(header: &str) -> String {
    header.replace(&format!("property {SHOT} shot"), &format!("property {EARLIER_SHOT} shot"))
}

/// Any source that can hand out its points in chunks, more than once.
pub trait PointSource {
    /// Calls `take` with every point, in order, in chunks of any size.
    fn for_each_chunk(&self, take: &mut dyn FnMut(&[CloudPoint])) -> Result<()>;
}

impl PointSource for [CloudPoint] {
    fn for_each_chunk(&self, take: &mut dyn FnMut(&[CloudPoint])) -> Result<()> {
        take(self);
        Ok(())
    }
}

impl PointSource for Vec<CloudPoint> {
    fn for_each_chunk(&self, take: &mut dyn FnMut(&[CloudPoint])) -> Result<()> {
        self.as_slice().for_each_chunk(take)
    }
}

/// Writes `PATH.part` point by point; [`CloudWriter::finish`] renames it to `PATH`.
pub struct CloudWriter {
    path: PathBuf,
    out: BufWriter<File>,
    count: u64,
    frame: &'static str,
}

impl CloudWriter {
    /// Starts a cloud; an unfinished one of the same name is discarded.
    pub fn create(path: &Path) -> Result<CloudWriter> {
        CloudWriter::create_in(path, FRAMES[0])
    }

    /// As [`CloudWriter::create`], for points in another frame than the robot's base.
    pub fn create_in(path: &Path, frame: &'static str) -> Result<CloudWriter> {
        debug_assert!(FRAMES.contains(&frame), "{frame}");
        let part = part_of(path);
        // Created anew, so that an existing link of that name is not followed.
        let file = remove(&part).and_then(|()| File::options().write(true).create_new(true).open(&part));
        let file = file.map_err(|e| Fault::write(&part, e))?;
        let out = BufWriter::with_capacity(1 << 20, file);
        let mut writer = CloudWriter { path: path.to_owned(), out, count: 0, frame };
        writer.put(header(0, frame).as_bytes())?;
        Ok(writer)
    }

    /// Continues an unfinished cloud after its first `keep` points, the count that [`CloudWriter::checkpoint`]
    /// returned. Later points are cut off.
    pub fn resume(path: &Path, keep: u64) -> Result<CloudWriter> {
        let part = part_of(path);
        // The scan stopped after the cloud got its final name, before the files that are made from it were written.
        if path.exists() && !part.exists() {
            moment().and_then(|()| std::fs::rename(path, &part)).map_err(|e| Fault::write(&part, e))?;
        }
        let mut file = File::options().read(true).write(true).open(&part).map_err(|e| Fault::read(&part, e))?;
        // The header may hold the final count already.
        // An earlier header has another length: `finish` could not replace its count.
        let head = head_of(&mut file).map_err(|e| Fault::read(&part, e))?.filter(|h| !h.earlier);
        let length = file.metadata().map_err(|e| Fault::read(&part, e))?.len();
        let (frame, start) = head.as_ref().map_or((FRAMES[0], 0), |h| (h.frame, h.length));
        // Saturating: a count that no file can hold gives a length that no file has.
        let wanted = keep.saturating_mul(RECORD).saturating_add(start);
        if head.is_none() || length < wanted {
            return Err(Fault::input(format!("{}: has {length} bytes, {wanted} needed to resume", part.display()))
                .cause("another program's file, or the disk lost written data")
                .next("start the scan again without resuming"));
        }
        file.set_len(wanted).and_then(|()| file.seek(SeekFrom::End(0))).map_err(|e| Fault::write(&part, e))?;
        let out = BufWriter::with_capacity(1 << 20, file);
        Ok(CloudWriter { path: path.to_owned(), out, count: keep, frame })
    }

    fn put(&mut self, bytes: &[u8]) -> Result<()> {
        self.out.write_all(bytes).map_err(|e| Fault::write(&part_of(&self.path), e))
    }

    /// Adds points at the end.
    ///
    /// # Errors
    /// A write that fails. The points up to the last [`CloudWriter::checkpoint`] can still be resumed.
    pub fn append(&mut self, points: &[CloudPoint]) -> Result<()> {
        self.put(bytemuck::cast_slice(points))?;
        self.count += points.len() as u64;
        Ok(())
    }

    /// Points written so far.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Syncs everything to the disk; the returned count is what [`CloudWriter::resume`] can keep.
    pub fn checkpoint(&mut self) -> Result<u64> {
        let done = moment().and_then(|()| self.out.flush()).and_then(|()| self.out.get_ref().sync_data());
        done.map_err(|e| Fault::write(&part_of(&self.path), e))?;
        Ok(self.count)
    }

    /// Writes the count into the header, syncs, and gives the file its final name.
    pub fn finish(mut self) -> Result<u64> {
        let part = part_of(&self.path);
        let done = moment()
            .and_then(|()| self.out.seek(SeekFrom::Start(0)))
            .and_then(|_| self.out.write_all(header(self.count, self.frame).as_bytes()))
            .and_then(|()| self.out.flush())
            .and_then(|()| moment())
            .and_then(|()| self.out.get_ref().sync_all())
            .and_then(|()| moment())
            .and_then(|()| std::fs::rename(&part, &self.path));
        done.map_err(|e| Fault::write(&self.path, e))?;
        Ok(self.count)
    }
}

/// The header of a cloud that this program wrote.
struct Head {
    frame: &'static str,
    count: u64,
    /// Bytes.
    length: u64,
    /// Whether it is as it was written before.
    earlier: bool,
}

/// `None` if the file does not begin with such a header.
fn head_of(file: &mut File) -> std::io::Result<Option<Head>> {
    let longest = FRAMES.iter().map(|f| earlier(&header(0, f)).len()).max().unwrap_or(0);
    let mut bytes = Vec::with_capacity(longest);
    file.take(longest as u64).read_to_end(&mut bytes)?;
    let known = FRAMES.into_iter().flat_map(|frame| [(frame, false), (frame, true)]);
    Ok(known.into_iter().find_map(|(frame, is_earlier)| {
        let written = |count| if is_earlier { earlier(&header(count, frame)) } else { header(count, frame) };
        let head = bytes.get(..written(0).len())?;
        let count = count_in(head)?;
        let same = written(count).as_bytes() == head;
        same.then_some(Head { frame, count, length: head.len() as u64, earlier: is_earlier })
    }))
}

/// The count that a header states.
fn count_in(head: &[u8]) -> Option<u64> {
    let text = std::str::from_utf8(head).ok()?;
    text.lines().find_map(|l| l.strip_prefix("element vertex "))?.parse().ok()
}

fn part_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".part");
    PathBuf::from(name)
}

/// Writes a whole cloud at once.
pub fn write_cloud(path: &Path, points: &[CloudPoint]) -> Result<()> {
    let mut out = CloudWriter::create(path)?;
    out.append(points)?;
    out.finish().map(|_| ())
}

/// A finished cloud on disk. Points are streamed; they are never all in memory.
#[derive(Clone, Debug)]
pub struct CloudFile {
    path: PathBuf,
    count: u64,
    start: u64,
    frame: &'static str,
}

impl CloudFile {
    /// Opens a PLY that this program wrote; other layouts are refused.
    pub fn open(path: &Path) -> Result<CloudFile> {
        let length = crate::files::length(path)?;
        let mut file = File::open(path).map_err(|e| Fault::read(path, e))?;
        let strange = |what: &str| {
            Fault::input(format!("{}: {what}", path.display()))
                .cause("a PLY of another program, or a truncated one")
                .next("give the cloud.ply of a sheetlight scan")
        };
        let head = head_of(&mut file).map_err(|e| Fault::read(path, e))?;
        let Head { count, length: start, frame, .. } =
            head.ok_or_else(|| strange("is too short for a cloud, or has another header"))?;
        let needed = count.saturating_mul(RECORD).saturating_add(start);
        if length != needed {
            return Err(strange(&format!("is {length} bytes long, {count} points need {needed}")));
        }
        Ok(CloudFile { path: path.to_owned(), count, start, frame })
    }
    /// Points in the file.
    pub fn count(&self) -> u64 {
        self.count
    }
    /// The frame that the header names.
    pub fn frame(&self) -> &'static str {
        self.frame
    }
}

impl PointSource for CloudFile {
    fn for_each_chunk(&self, take: &mut dyn FnMut(&[CloudPoint])) -> Result<()> {
        let mut file = File::open(&self.path).map_err(|e| Fault::read(&self.path, e))?;
        file.seek(SeekFrom::Start(self.start)).map_err(|e| Fault::read(&self.path, e))?;
        let mut buffer = vec![CloudPoint::default(); CHUNK];
        let mut left = self.count;
        while left > 0 {
            let n = left.min(CHUNK as u64) as usize;
            file.read_exact(bytemuck::cast_slice_mut(&mut buffer[..n])).map_err(|e| Fault::read(&self.path, e))?;
            take(&buffer[..n]);
            left -= n as u64;
        }
        Ok(())
    }
}

/// Reads a whole cloud into memory.
pub fn read_cloud(path: &Path) -> Result<Vec<CloudPoint>> {
    let file = CloudFile::open(path)?;
    let mut all = Vec::with_capacity(file.count as usize);
    file.for_each_chunk(&mut |chunk| all.extend_from_slice(chunk))?;
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn some(n: u32) -> Vec<CloudPoint> {
        (0..n)
            .map(|i| CloudPoint {
                position: [i as f32, 0.5, -2.0].into(),
                shot: i / 7,
                u: i as f32 * 0.25,
                ..Default::default()
            })
            .collect()
    }

    #[test]
    fn a_cloud_comes_back_as_it_was() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let points = some(100_001);
        write_cloud(&path, &points).unwrap();
        assert_eq!(read_cloud(&path).unwrap(), points);
    }

    /// An independent PLY reader agrees on header and records.
    #[test]
    fn another_reader_understands_it() {
        #[derive(serde::Deserialize)]
        struct Row {
            x: f32,
            z: f32,
            shot: u32,
            u: f32,
        }
        #[derive(serde::Deserialize)]
        struct File {
            vertex: Vec<Row>,
        }
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        write_cloud(&path, &some(20)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let file: File = serde_ply::from_bytes(&bytes).unwrap();
        assert_eq!(file.vertex.len(), 20);
        let row = &file.vertex[15];
        assert_eq!((row.x, row.z, row.shot, row.u), (15.0, -2.0, 2, 3.75));
    }

    #[test]
    fn clouds_with_the_earlier_header_are_read_and_not_resumed() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let points = some(30);
        for frame in FRAMES {
            let mut bytes = earlier(&header(30, frame)).into_bytes();
            assert!(String::from_utf8_lossy(&bytes).contains("property uint shot"));
            bytes.extend(bytemuck::cast_slice::<CloudPoint, u8>(&points));
            std::fs::write(&path, &bytes).unwrap();
            assert_eq!(read_cloud(&path).unwrap(), points);
            assert_eq!(CloudFile::open(&path).unwrap().frame(), frame);
            std::fs::write(part_of(&path), &bytes).unwrap();
            assert!(CloudWriter::resume(&path, 30).is_err());
        }
    }

    #[test]
    fn an_unfinished_cloud_resumes_and_has_no_final_name() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let points = some(50);
        let mut writer = CloudWriter::create(&path).unwrap();
        writer.append(&points[..30]).unwrap();
        assert_eq!(writer.checkpoint().unwrap(), 30);
        writer.append(&points[10..20]).unwrap();
        drop(writer);
        assert!(!path.exists());
        let mut writer = CloudWriter::resume(&path, 30).unwrap();
        writer.append(&points[30..]).unwrap();
        assert_eq!(writer.finish().unwrap(), 50);
        assert_eq!(read_cloud(&path).unwrap(), points);
        // A scan that stopped after the cloud got its final name resumes it as an unfinished cloud.
        drop(CloudWriter::resume(&path, 20).unwrap());
        assert!(!path.exists());
        let mut writer = CloudWriter::resume(&path, 20).unwrap();
        writer.append(&points[20..]).unwrap();
        writer.finish().unwrap();
        assert_eq!(read_cloud(&path).unwrap(), points);
    }

    #[test]
    fn a_truncated_cloud_is_refused() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        write_cloud(&path, &some(20)).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::write(&path, &bytes[..bytes.len() - 3]).unwrap();
        assert!(read_cloud(&path).unwrap_err().what.contains("20 points need"));
    }
}
