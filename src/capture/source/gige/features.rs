//! In: a camera under control. Out: its features with their values and ranges, and those that have to be restored.
//! Frame and unit: as the camera states them.

use crate::capture::feature::{Feature, Range, Value};
use viva_genicam::genapi::FeatureValue;
use viva_genicam::{Camera, GenicamError, GigeRegisterIo};

const FORMER: [(&str, &str); 5] = [
    ("ExposureTime", "ExposureTimeAbs"),
    ("Gain", "GainRaw"),
    ("AcquisitionFrameRate", "AcquisitionFrameRateAbs"),
    ("TriggerDelay", "TriggerDelayAbs"),
    ("AcquisitionFrameRateEnable", "AcquisitionFrameRateEnabled"),
];
/// Features that are restored, in this order, when a camera comes back with its defaults.
const SETTINGS: [&str; 22] = [
    "Scan3dOutputMode",
    "PixelFormat",
    "BinningHorizontal",
    "BinningVertical",
    "DecimationHorizontal",
    "DecimationVertical",
    "ReverseX",
    "ReverseY",
    "Width",
    "Height",
    "OffsetX",
    "OffsetY",
    "ExposureTime",
    "Gain",
    "AcquisitionFrameRateEnable",
    "AcquisitionFrameRate",
    "TriggerSelector",
    "TriggerSource",
    "TriggerActivation",
    "TriggerDelay",
    "TriggerMode",
    "ChunkModeActive",
];

/// Current values of all settings that affect pictures.
pub fn settings(camera: &mut Camera<GigeRegisterIo>) -> Vec<(&'static str, String)> {
    let kept = |name: &&'static str| {
        let own = own_name(camera, name);
        let feature = feature(camera, own)?;
        Some((own, feature.value.filter(|_| feature.writable)?.to_string()))
    };
    SETTINGS.iter().filter_map(kept).collect()
}

/// Sets what differs from these settings; the name and the error of the first that cannot be set.
pub fn restore(
    camera: &mut Camera<GigeRegisterIo>,
    kept: &[(&'static str, String)],
) -> Result<(), (&'static str, GenicamError)> {
    for (name, value) in kept {
        if feature(camera, name).and_then(|f| f.value).is_some_and(|is| is.to_string() != *value) {
            camera.set(name, value).map_err(|e| (*name, e))?;
        }
    }
    Ok(())
}

/// This camera's name for a standard feature: cameras from before the standard's second version use other names.
pub fn own_name<'a>(camera: &Camera<GigeRegisterIo>, name: &'a str) -> &'a str {
    let has = |n: &&str| camera.nodemap().node(n).is_some();
    let former = FORMER.iter().filter(|(now, _)| *now == name).map(|(_, then)| *then);
    std::iter::once(name).chain(former).find(has).unwrap_or(name)
}

/// A feature with its present value; none if the user can neither set nor read it.
pub fn feature(camera: &mut Camera<GigeRegisterIo>, name: &str) -> Option<Feature> {
    let state = camera.feature_state(name).ok()?;
    if !state.is_implemented || !state.is_available || state.access.is_none() {
        return None;
    }
    let value = match (state.kind, state.value) {
        ("Command", _) => Some(Value::Command),
        (_, FeatureValue::Integer(v)) => Some(Value::Integer(v)),
        (_, FeatureValue::Float(v)) => Some(Value::Float(v)),
        (_, FeatureValue::Boolean(v)) => Some(Value::Boolean(v)),
        (_, FeatureValue::Enum(v) | FeatureValue::String(v)) => Some(Value::Word(v)),
        _ => return None,
    };
    let range = match (state.enum_entries, state.range) {
        (Some(words), _) => Range::OneOf(words),
        (None, Some(r)) => Range::Between(r.min, r.max),
        _ => Range::Any,
    };
    let writable = !matches!(state.access, Some(viva_genicam::genapi::AccessMode::RO));
    Some(Feature { name: name.into(), value, unit: state.unit.unwrap_or_default(), range, writable })
}

/// Chooses the component of heights if the camera sends it, and returns whether it sends several components.
pub fn several(camera: &mut Camera<GigeRegisterIo>) -> bool {
    let Some(Range::OneOf(components)) = feature(camera, "ComponentSelector").map(|f| f.range) else { return false };
    let mut enabled = Vec::new();
    for name in &components {
        let chosen = camera.set("ComponentSelector", name).is_ok();
        camera.invalidate("ComponentEnable");
        let enables = feature(camera, "ComponentEnable").and_then(|f| f.value);
        if chosen && enables == Some(Value::Boolean(true)) {
            enabled.push(name);
        }
    }
    if let Some(name) = enabled.iter().find(|name| **name == "Range").or(enabled.first()) {
        let _ = camera.set("ComponentSelector", name);
    }
    enabled.len() > 1
}
