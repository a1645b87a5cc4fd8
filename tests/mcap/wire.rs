//! In: the bytes of a message in CDR. Out: its fields, one after the other; written apart from what writes them.
//! Frame and unit: metres become mm.

use sheetlight::geometry::{Frame, Mat3, Rigid, Vec3};
use sheetlight::scan::CloudPoint;

pub struct Wire<'a> {
    body: &'a [u8],
    at: usize,
}

impl<'a> Wire<'a> {
    pub fn new(message: &'a [u8]) -> Wire<'a> {
        assert_eq!(message[..4], [0, 1, 0, 0]);
        Wire { body: &message[4..], at: 0 }
    }

    fn take<const N: usize>(&mut self) -> [u8; N] {
        self.at = self.at.next_multiple_of(N);
        self.at += N;
        self.body[self.at - N..self.at].try_into().unwrap()
    }

    pub fn u8(&mut self) -> u8 {
        self.take::<1>()[0]
    }

    pub fn u32(&mut self) -> u32 {
        u32::from_le_bytes(self.take())
    }

    pub fn f64s(&mut self, n: usize) -> Vec<f64> {
        (0..n).map(|_| f64::from_le_bytes(self.take())).collect()
    }

    pub fn bytes(&mut self) -> &'a [u8] {
        let n = self.u32() as usize;
        self.at += n;
        &self.body[self.at - n..self.at]
    }

    pub fn string(&mut self) -> String {
        let bytes = self.bytes();
        let (zero, text) = bytes.split_last().unwrap();
        assert_eq!(*zero, 0);
        String::from_utf8(text.to_vec()).unwrap()
    }

    /// The time of a header of this frame, ns.
    pub fn header(&mut self, frame: &str) -> u64 {
        let (sec, ns) = (u64::from(self.u32()), u64::from(self.u32()));
        assert!(self.string() == frame && ns < 1_000_000_000);
        sec * 1_000_000_000 + ns
    }

    /// Metres and a quaternion x y z w, as mm.
    pub fn rigid<To: Frame, From: Frame>(&mut self) -> Rigid<To, From> {
        let n = self.f64s(7);
        let [x, y, z, w] = n[3..].try_into().unwrap();
        assert!((x * x + y * y + z * z + w * w - 1.0).abs() < 1e-12);
        let rotation = Mat3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - z * w),
            2.0 * (x * z + y * w),
            2.0 * (x * y + z * w),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - x * w),
            2.0 * (x * z - y * w),
            2.0 * (y * z + x * w),
            1.0 - 2.0 * (x * x + y * y),
        );
        Rigid::new(rotation, Vec3::new(n[0], n[1], n[2]) * 1000.0)
    }

    /// How far a transform that stands here is from another: mm, and the norm of what the rotations differ by.
    pub fn apart<To: Frame, From: Frame>(&mut self, other: &Rigid<To, From>) -> (f64, f64) {
        let read: Rigid<To, From> = self.rigid();
        ((read.translation - other.translation).norm(), (read.rotation - other.rotation).norm())
    }

    pub fn end(&self) {
        assert_eq!(self.at, self.body.len(), "bytes behind the message");
    }
}

/// The points of a PointCloud2 by the names, offsets and kinds that it states: each with x y z and sigma in metres.
pub fn points(message: &[u8], frame: &str) -> Vec<(CloudPoint, [f32; 4])> {
    let mut w = Wire::new(message);
    w.header(frame);
    assert_eq!(w.u32(), 1, "height");
    let width = w.u32() as usize;
    let fields: Vec<(String, usize, u8)> = (0..w.u32())
        .map(|_| {
            let field = (w.string(), w.u32() as usize, w.u8());
            assert_eq!(w.u32(), 1);
            field
        })
        .collect();
    assert_eq!(w.u8(), 0, "is_bigendian");
    let (step, row) = (w.u32() as usize, w.u32() as usize);
    let data = w.bytes();
    assert!(row == width * step && data.len() == row);
    assert_eq!(w.u8(), 1, "is_dense");
    w.end();
    let word = |record: &[u8], name: &str, kind: u8| {
        let field = fields.iter().find(|f| f.0 == name).unwrap_or_else(|| panic!("no field {name}"));
        assert_eq!(field.2, kind);
        u32::from_le_bytes(record[field.1..field.1 + 4].try_into().unwrap())
    };
    let one = |record: &[u8]| {
        let float = |name: &str| f32::from_bits(word(record, name, 7));
        let [intensity, quality, u, v] = ["intensity", "quality", "u", "v"].map(float);
        let point = CloudPoint { intensity, quality, u, v, shot: word(record, "shot", 6), ..CloudPoint::default() };
        (point, ["x", "y", "z", "sigma"].map(float))
    };
    data.chunks_exact(step).map(one).collect()
}
