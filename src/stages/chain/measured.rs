//! In: the pixel list of a batch, the settings of peaks and of their choice, the rig, the shots' poses. Out: dispatches
//! that compute chosen peaks and points from it. Frame and unit: pixels and grey levels; points in the poses' frame,
//! mm.

use super::measure::Measure;
use super::part::{Part, whole};
use crate::fault::Result;
use crate::gpu::{Buffer, Device, Pipeline, Recording};
use crate::stages::frame::{PX_LOG2, px_log2};
use crate::stages::peak::PeakFrame;
use crate::stages::peak::found::Peak;
use crate::stages::stripe::choose::Lines;
use crate::stages::stripe::optics::PointFrame;
use crate::stages::stripe::point::Point;
use crate::stages::stripe::{choose, point};
use crate::stages::{Frame, peak};

/// Bytes of one shot's pose: three rows of rotation and translation.
pub const POSE_BYTES: u64 = 48;

/// Compiled stages and the buffers that all batches use one after the other.
pub struct Measuring {
    frame: PeakFrame,
    uniform: Buffer,
    rig: Buffer,
    /// The skeleton pixels.
    pub pixels: Buffer,
    strongest: Buffer,
    peak: Pipeline,
    lines: Pipeline,
    point: Pipeline,
}

impl Measuring {
    /// Compiles the stages and makes their buffers for batches with the layout `f`, of pictures of `bits`, 8..=16.
    pub fn new(device: &Device, f: &Frame, bits: u8, m: &Measure) -> Result<Measuring> {
        let frame = PeakFrame::new((f.width, f.height, bits), f.shots, &m.peak, &m.choose, m.optics.across());
        let uniform = device.storage("peak frame", size_of::<PeakFrame>() as u64)?;
        device.write(&uniform, 0, bytemuck::bytes_of(&frame));
        let rig = device.storage("rig", size_of::<PointFrame>() as u64)?;
        device.write(&rig, 0, bytemuck::bytes_of(&PointFrame::new(&m.optics, &Lines::new(&frame, &m.choose))));
        let method = m.peak.method.number();
        let depth = [(PX_LOG2, f64::from(px_log2(bits))), (peak::METHOD, method), (peak::QUADS, frame.quads().into())];
        Ok(Measuring {
            pixels: device.storage("skeleton pixels", 8 * u64::from(f.capacity))?,
            strongest: device.storage("strongest", 4 * u64::from(frame.entries))?,
            peak: peak::STAGE.pipeline(device, &depth)?,
            lines: choose::LINES.pipeline(device, &[])?,
            point: point::STAGE.pipeline(device, &[(point::FULL_LENS, m.optics.full_lens())])?,
            frame,
            uniform,
            rig,
        })
    }

    /// Sizes in bytes of the two outputs of a batch, peaks and points.
    pub fn output_bytes(f: &Frame) -> Vec<u64> {
        let n = u64::from(f.capacity);
        vec![n * size_of::<Peak>() as u64, n * size_of::<Point>() as u64]
    }

    /// Dispatches from the pixel list to the points; the number of workgroups is read from `header`.
    pub fn record(
        &self,
        device: &Device,
        image: &Buffer,
        poses: Part,
        header: &Buffer,
        peaks: &Buffer,
        points: &Buffer,
    ) -> Recording {
        let mut r = Recording::default();
        let (uniform, head, peaks, strongest) =
            (whole(&self.uniform), whole(header), whole(peaks), whole(&self.strongest));
        let each = (header, 0);
        r.dispatch_parts(device, &self.lines, &[uniform, strongest], choose::lines_groups(&self.frame));
        r.indirect(device, &self.peak, &[uniform, whole(image), head, whole(&self.pixels), peaks, strongest], each);
        r.indirect(device, &self.point, &[whole(&self.rig), head, poses, strongest, peaks, whole(points)], each);
        r
    }
}
