//! How a camera reads its sensor, by the features of GenICam's Standard Features Naming Convention.

use crate::camera::Readout;
use viva_genicam::{Camera, GigeRegisterIo};

/// Region, binning and decimation; none if the camera does not report all that it supports of them.
pub fn of(camera: &Camera<GigeRegisterIo>) -> Option<Readout> {
    let has = |name: &str| camera.nodemap().node(name).is_some();
    let number = |name: &str, without: u32| {
        if has(name) { camera.get_integer(name).ok().and_then(|v| u32::try_from(v).ok()) } else { Some(without) }
    };
    let flag = |name: &str| if has(name) { camera.get_bool(name).ok() } else { Some(false) };
    let pair = |x: &str, y: &str, without: u32| Some([number(x, without)?, number(y, without)?]);
    let [mut binning, mut decimation] =
        [pair("BinningHorizontal", "BinningVertical", 1)?, pair("DecimationHorizontal", "DecimationVertical", 1)?];
    for (i, mode) in ["DecimationHorizontalMode", "DecimationVerticalMode"].into_iter().enumerate() {
        // A pixel averaged from several lies at their middle, like a binned one.
        if has(mode) && camera.get_enum(mode).ok()? == "Average" {
            (binning[i], decimation[i]) = (binning[i] * decimation[i], 1);
        }
    }
    let readout = Readout {
        offset_px: pair("OffsetX", "OffsetY", 0)?,
        binning,
        decimation,
        reversed: [flag("ReverseX")?, flag("ReverseY")?],
        ..Readout::default()
    };
    let step = readout.step();
    if step.contains(&0) {
        return None;
    }
    // The largest possible picture with this binning and decimation.
    let most = if has("WidthMax") && has("HeightMax") { Some(pair("WidthMax", "HeightMax", 0)?) } else { None };
    let most = most.map(|m| [m[0].saturating_mul(step[0]), m[1].saturating_mul(step[1])]);
    let sensor = if has("SensorWidth") && has("SensorHeight") { pair("SensorWidth", "SensorHeight", 0) } else { None };
    // The picture can also be smaller because of a manufacturer's mode that is none of these.
    let explained = most.zip(sensor).is_none_or(|(m, s)| (0..2).all(|i| f64::from(m[i]) > 0.9 * f64::from(s[i])));
    let sensor_px = most.or(sensor);
    let says = ["OffsetX", "BinningHorizontal", "DecimationHorizontal", "WidthMax"].into_iter().any(has);
    (says && explained).then_some(Readout { sensor_px, ..readout })
}
