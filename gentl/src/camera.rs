//! In: an entry of the list of devices, and what a program writes. Out: the open remote device: its features, its
//! state, its next frame.
//! Frame and unit: mm, degrees, ns since 1970.

use crate::config::{Device, Origin};
use crate::event::Event;
use crate::features::{COUNT, Category, Choice, Feature, Kind, Most, Table, Value, Values, free, set, shown};
use crate::settings::{Settings, mode, output};
use crate::source::{Layout, Source, Taken};
use crate::standard::{component, error, pixel};
use crate::status::{Result, refuse};
use crate::stream::Stream;
use sheetlight::geometry::{Base, Grid, Rigid, Vec3};
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard};
use std::time::SystemTime;

/// The remote device behind an open device.
pub struct Camera {
    pub device: Device,
    pub layout: Layout,
    source: Mutex<Source>,
    state: Mutex<State>,
    /// Told of every change of the state.
    pub changed: Condvar,
    /// Ends the scan that is being made.
    pub stop: Arc<AtomicBool>,
    errors: Mutex<Option<Arc<Event>>>,
    clock: AtomicU64,
}

pub struct State {
    pub settings: Settings,
    /// Between AcquisitionStart and its end.
    pub running: bool,
    /// Counts the starts: a frame that was begun before the last one is not given.
    pub epoch: u64,
    /// Frames until the acquisition ends, in its modes with an end.
    pub left: Option<u64>,
    /// Software triggers that have no frame yet.
    pub triggers: u64,
    /// Frames come when a scan was finished elsewhere.
    pub external: bool,
    pub frame_id: u64,
    pub fault: String,
    pub stream: Option<Stream>,
    locked: bool,
    component: i64,
    axis: i64,
    reference: i64,
    latched_ns: u64,
    pose: Option<Rigid<Base, Grid>>,
    frame: String,
}

impl State {
    /// Keeps what a frame says about its coordinates.
    pub fn seen(&mut self, taken: &Taken) {
        self.pose = Some(taken.map.base_from_grid);
        self.frame.clone_from(&taken.frame);
    }
}

impl Camera {
    pub fn open(device: &Device, origin: &Origin) -> Result<Camera> {
        let (source, layout) = Source::open(origin)?;
        let external = source.is_external();
        let state = State {
            settings: Settings::new(&layout, external),
            running: false,
            epoch: 0,
            left: None,
            triggers: 0,
            external,
            frame_id: 0,
            fault: String::new(),
            stream: None,
            locked: false,
            component: component::RANGE,
            axis: 0,
            reference: 0,
            latched_ns: 0,
            pose: layout.base_from_grid,
            frame: layout.frame.clone(),
        };
        Ok(Camera {
            device: device.clone(),
            layout,
            source: Mutex::new(source),
            state: Mutex::new(state),
            changed: Condvar::new(),
            stop: Arc::default(),
            errors: Mutex::default(),
            clock: AtomicU64::new(0),
        })
    }

    pub fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// The event of the device that reports errors, if it is registered.
    pub fn errors(&self) -> MutexGuard<'_, Option<Arc<Event>>> {
        self.errors.lock().unwrap_or_else(|e| e.into_inner())
    }

    /// Nanoseconds since 1970; no two calls get the same.
    pub fn now_ns(&self) -> u64 {
        let now = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_nanos() as u64);
        let last = self.clock.fetch_max(now, Ordering::Relaxed);
        if last < now { now } else { 1 + self.clock.fetch_add(1, Ordering::Relaxed) }
    }

    /// The next frame. It may take as long as a scan.
    pub fn next(&self) -> Result<Option<Arc<Taken>>> {
        let mut source = self.source.lock().unwrap_or_else(|e| e.into_inner());
        let taken = source.next(&self.stop)?;
        if let Some(map) = taken.as_ref().map(|t| &t.map) {
            let size = [map.width, map.height];
            assert_eq!(size, [self.layout.width, self.layout.height], "a frame has the cells of its device");
        }
        Ok(taken)
    }

    fn start(&self) -> Result<()> {
        if self.state().running {
            return Ok(());
        }
        self.source.lock().unwrap_or_else(|e| e.into_inner()).begin()?;
        let mut state = self.state();
        state.left = match state.settings.acquisition {
            mode::SINGLE => Some(1),
            mode::MULTI => Some(state.settings.frame_count as u64),
            _ => None,
        };
        (state.running, state.triggers, state.frame_id) = (true, 0, 0);
        state.epoch += 1;
        state.fault.clear();
        self.changed.notify_all();
        Ok(())
    }

    fn end(&self) {
        let mut state = self.state();
        state.running = false;
        self.stop.store(true, Ordering::Relaxed);
        self.changed.notify_all();
    }

    fn trigger(&self) -> Result<()> {
        let mut state = self.state();
        if !(state.running && state.settings.triggered) || state.external {
            return refuse(
                error::ACCESS_DENIED,
                "TriggerSoftware needs TriggerMode On, TriggerSource Software and a started acquisition",
            );
        }
        state.triggers += 1;
        self.changed.notify_all();
        Ok(())
    }

    /// Scale and offset of a coordinate: metric = scale · stored + offset. Of A and B of a rectified map, the column
    /// and the row in the buffer are what is stored.
    fn scale(&self, state: &State) -> (f64, f64) {
        let (Layout { cell_mm, low_mm, step_mm, .. }, region) = (&self.layout, state.settings.region);
        if state.settings.output != output::RECTIFIED_C {
            return (1.0, 0.0);
        }
        match (state.axis, state.settings.components[&component::RANGE].format) {
            (0, _) => (*cell_mm, (f64::from(region.x) + 0.5) * cell_mm),
            (1, _) => (*cell_mm, (f64::from(region.y) + 0.5) * cell_mm),
            (_, pixel::COORD3D_C16) => (*step_mm, low_mm - step_mm),
            _ => (1.0, 0.0),
        }
    }

    /// The value of the selected coordinate where nothing was measured; `None` for the places of a rectified map.
    fn invalid(&self, state: &State) -> Option<f64> {
        match (state.settings.output, state.axis, state.settings.components[&component::RANGE].format) {
            (output::RECTIFIED_C, 0 | 1, _) => None,
            (_, _, pixel::COORD3D_C16) => Some(0.0),
            _ => Some(f64::NAN),
        }
    }

    /// Least and greatest value of the selected coordinate, mm; as far as a float reaches while it is not known.
    fn axis_limits(&self, state: &State) -> (f64, f64) {
        let Layout { width, height, cell_mm, low_mm, step_mm, .. } = &self.layout;
        let (w, h) = (f64::from(*width) * cell_mm, f64::from(*height) * cell_mm);
        let high_mm = low_mm + 65_534.0 * step_mm;
        let sides = [(0.0, w), (0.0, h), (*low_mm, high_mm)];
        let axis = state.axis.clamp(0, 2) as usize;
        match (state.settings.output, state.pose) {
            (output::RECTIFIED_C, _) => sides[axis],
            (output::GRID, Some(pose)) => {
                let mut limits = (f64::INFINITY, f64::NEG_INFINITY);
                for i in 0..8 {
                    let at = |k: usize| if i >> k & 1 == 0 { sides[k].0 } else { sides[k].1 };
                    let value = pose.point(&Vec3::new(at(0), at(1), at(2)))[axis];
                    limits = (limits.0.min(value), limits.1.max(value));
                }
                limits
            }
            _ => (f64::from(f32::MIN), f64::from(f32::MAX)),
        }
    }

    /// Pose of the coordinates in the cloud's frame: first turned about X, then Y, then Z, degrees; then moved, mm.
    fn reference(&self, state: &State) -> f64 {
        let (output::RECTIFIED_C, Some(pose)) = (state.settings.output, state.pose) else { return 0.0 };
        let (r, t) = (pose.rotation, pose.translation);
        let level = r[(2, 0)].abs() < 1.0 - 1e-12;
        let radians = match state.reference {
            0 if level => r[(2, 1)].atan2(r[(2, 2)]),
            0 => (-r[(1, 2)]).atan2(r[(1, 1)]),
            1 => (-r[(2, 0)]).clamp(-1.0, 1.0).asin(),
            2 if level => r[(1, 0)].atan2(r[(0, 0)]),
            2 => 0.0,
            n => return t[(n - 3).clamp(0, 2) as usize],
        };
        radians.to_degrees()
    }
}

impl Values for Camera {
    fn get(&self, name: &str) -> Result<Value> {
        let state = &*self.state();
        let (settings, region) = (&state.settings, state.settings.region);
        let [width, height] = settings.most(&self.layout);
        let chosen = settings.components[&state.component];
        let text = |t: &str| Value::Text(t.to_owned());
        let int = |n: u32| Value::Integer(i64::from(n));
        let flag = |b: bool| Value::Integer(i64::from(b));
        Ok(match name {
            "DeviceVendorName" => text("Sheetlight"),
            "DeviceModelName" => text(self.device.model()),
            "DeviceVersion" => text(env!("CARGO_PKG_VERSION")),
            "DeviceSerialNumber" => text(&self.device.id),
            "DeviceUserID" => text(self.device.shown_name()),
            "DeviceScanType" => Value::Integer(0),
            "DeviceSFNCVersionMajor" => Value::Integer(2),
            "DeviceSFNCVersionMinor" => Value::Integer(7),
            "DeviceSFNCVersionSubMinor" => Value::Integer(0),
            "TimestampLatchValue" => Value::Integer(state.latched_ns as i64),
            "WidthMax" => int(width),
            "HeightMax" => int(height),
            "SheetlightWidthLimit" => int(width - region.x),
            "SheetlightHeightLimit" => int(height - region.y),
            "SheetlightOffsetXLimit" => int(width - region.width),
            "SheetlightOffsetYLimit" => int(height - region.height),
            "Width" => int(region.width),
            "Height" => int(region.height),
            "OffsetX" => int(region.x),
            "OffsetY" => int(region.y),
            "ComponentSelector" | "ComponentIDValue" => Value::Integer(state.component),
            "ComponentEnable" => flag(chosen.enabled),
            "PixelFormat" => Value::Integer(chosen.format),
            "AcquisitionMode" => Value::Integer(settings.acquisition),
            "AcquisitionFrameCount" => Value::Integer(settings.frame_count),
            "AcquisitionFrameRate" => Value::Float(settings.rate_hz),
            "TriggerSelector" => Value::Integer(0),
            "TriggerMode" => flag(settings.triggered),
            "TriggerSource" => flag(state.external),
            "Scan3dDistanceUnit" | "Scan3dCoordinateSystem" | "Scan3dCoordinateSystemReference" => Value::Integer(0),
            "Scan3dOutputMode" => Value::Integer(settings.output),
            "Scan3dCoordinateSelector" => Value::Integer(state.axis),
            "Scan3dCoordinateScale" => Value::Float(self.scale(state).0),
            "Scan3dCoordinateOffset" => Value::Float(self.scale(state).1),
            "Scan3dInvalidDataFlag" => flag(self.invalid(state).is_some()),
            "Scan3dInvalidDataValue" => Value::Float(self.invalid(state).unwrap_or(0.0)),
            "Scan3dAxisMin" => Value::Float(self.axis_limits(state).0),
            "Scan3dAxisMax" => Value::Float(self.axis_limits(state).1),
            "Scan3dCoordinateReferenceSelector" => Value::Integer(state.reference),
            "Scan3dCoordinateReferenceValue" => Value::Float(self.reference(state)),
            "PayloadSize" => Value::Integer(settings.payload() as i64),
            "TLParamsLocked" => flag(state.locked || state.running),
            "SheetlightFrame" => text(&state.frame),
            "SheetlightConfidenceHalfSigma" => Value::Float(settings.half_sigma_mm),
            "SheetlightLastFault" => text(&state.fault),
            other => return refuse(error::ERROR, format!("{other} has no value")),
        })
    }

    fn set(&self, name: &str, value: Value) -> Result<()> {
        match name {
            "AcquisitionStart" => return self.start(),
            "AcquisitionStop" => {
                self.end();
                return Ok(());
            }
            "TriggerSoftware" => return self.trigger(),
            _ => {}
        }
        let state = &mut *self.state();
        let refused = |why: &str| refuse(error::INVALID_VALUE, format!("{name} stays as it is: {why}"));
        // A frame that is being filled keeps its size.
        if state.stream.as_ref().is_some_and(|s| s.filling) && DURING.iter().all(|f| *f != name) {
            return refuse(error::ACCESS_DENIED, format!("{name} stays as it is: a frame is being made"));
        }
        let n = match value {
            Value::Integer(n) => n,
            Value::Float(x) => {
                match name {
                    "AcquisitionFrameRate" => state.settings.rate_hz = x,
                    _ => state.settings.half_sigma_mm = x,
                }
                self.changed.notify_all();
                return Ok(());
            }
            Value::Text(_) => return refused("no text is written"),
        };
        let settings = &mut state.settings;
        match name {
            "TimestampLatch" => state.latched_ns = self.now_ns(),
            // The table has checked them against their limits.
            "Width" => settings.region.width = n as u32,
            "Height" => settings.region.height = n as u32,
            "OffsetX" => settings.region.x = n as u32,
            "OffsetY" => settings.region.y = n as u32,
            "ComponentSelector" => state.component = n,
            "ComponentEnable" => {
                let others = settings.components.iter().any(|(id, c)| c.enabled && *id != state.component);
                if n == 0 && !others {
                    return refused("a frame has at least one component");
                }
                settings.components.get_mut(&state.component).expect("one of the choices").enabled = n != 0;
            }
            "PixelFormat" => {
                if !formats(state.component).contains(&n) {
                    return refused("it is not a format of the selected component");
                }
                let rectified = settings.output == output::RECTIFIED_C;
                match n {
                    pixel::COORD3D_ABC32F if rectified => settings.set_output(output::GRID, &self.layout),
                    pixel::COORD3D_C16 | pixel::COORD3D_C32F if !rectified => {
                        settings.set_output(output::RECTIFIED_C, &self.layout);
                    }
                    _ => {}
                }
                settings.components.get_mut(&state.component).expect("one of the choices").format = n;
            }
            "Scan3dOutputMode" => {
                if n == output::POINT_CLOUD && self.layout.points == 0 {
                    return refused("only the device of a finished scan gives its points");
                }
                settings.set_output(n, &self.layout);
            }
            "AcquisitionMode" => settings.acquisition = n,
            "AcquisitionFrameCount" => settings.frame_count = n,
            "TriggerMode" if state.external && n == 0 => return refused("frames come when a scan is finished"),
            "TriggerMode" => settings.triggered = n != 0,
            "TriggerSource" if (n == 1) != state.external => {
                return refused("NewScan is the source of folders, Software that of all other devices");
            }
            "TriggerSource" | "TriggerSelector" => {}
            "Scan3dCoordinateSelector" => state.axis = n,
            "Scan3dCoordinateReferenceSelector" => state.reference = n,
            "TLParamsLocked" => state.locked = n != 0,
            other => return refuse(error::ERROR, format!("{other} is not written")),
        }
        self.changed.notify_all();
        Ok(())
    }
}

/// Features that change no frame.
const DURING: [&str; 6] = [
    "TimestampLatch",
    "ComponentSelector",
    "Scan3dCoordinateSelector",
    "Scan3dCoordinateReferenceSelector",
    "TriggerSelector",
    "TLParamsLocked",
];

/// Pixel formats of a component.
fn formats(component: i64) -> Vec<i64> {
    FORMATS.iter().filter(|c| c.when == Some(("ComponentSelector", component))).map(|c| c.value).collect()
}

const fn choice(name: &'static str, value: i64) -> Choice {
    Choice { name, value, when: None }
}

const fn format(name: &'static str, value: i64, component: i64) -> Choice {
    Choice { name, value, when: Some(("ComponentSelector", component)) }
}

const FORMATS: &[Choice] = &[
    format("Coord3D_ABC32f", pixel::COORD3D_ABC32F, component::RANGE),
    format("Coord3D_C16", pixel::COORD3D_C16, component::RANGE),
    format("Coord3D_C32f", pixel::COORD3D_C32F, component::RANGE),
    format("Mono8", pixel::MONO8, component::INTENSITY),
    format("Mono16", pixel::MONO16, component::INTENSITY),
    format("Confidence8", pixel::CONFIDENCE8, component::CONFIDENCE),
    format("Confidence16", pixel::CONFIDENCE16, component::CONFIDENCE),
];
const COMPONENTS: &[Choice] = &[
    choice("Intensity", component::INTENSITY),
    choice("Range", component::RANGE),
    choice("Confidence", component::CONFIDENCE),
];
const MODES: &[Choice] =
    &[choice("SingleFrame", mode::SINGLE), choice("MultiFrame", mode::MULTI), choice("Continuous", mode::CONTINUOUS)];
const OUTPUTS: &[Choice] = &[
    choice("RectifiedC", output::RECTIFIED_C),
    choice("CalibratedABC_Grid", output::GRID),
    choice("CalibratedABC_PointCloud", output::POINT_CLOUD),
];
const AXES: &[Choice] = &[choice("CoordinateA", 0), choice("CoordinateB", 1), choice("CoordinateC", 2)];
const REFERENCES: &[Choice] = &[
    choice("RotationX", 0),
    choice("RotationY", 1),
    choice("RotationZ", 2),
    choice("TranslationX", 3),
    choice("TranslationY", 4),
    choice("TranslationZ", 5),
];

/// The features of a remote device.
pub fn table() -> Table {
    const LENGTH: Kind = Kind::Float { least: f32::MIN as f64, most: f32::MAX as f64, unit: "mm" };
    let pixels = |most| Kind::Integer { least: 1, most: Most::Of(most) };
    let offset = |most| Kind::Integer { least: 0, most: Most::Of(most) };
    let category = |name, features: Vec<Feature>| Category { name, features };
    let device = vec![
        shown("DeviceVendorName", "Maker of the device", Kind::Text),
        shown("DeviceModelName", "Where the frames come from", Kind::Text),
        shown("DeviceVersion", "Version of this library", Kind::Text),
        shown("DeviceSerialNumber", "The device's id in the list of devices", Kind::Text),
        shown("DeviceUserID", "The device's name in the list of devices", Kind::Text),
        shown("DeviceScanType", "Kind of the sensor", Kind::Choice(const { &[choice("Areascan3D", 0)] })),
        shown("DeviceSFNCVersionMajor", "Version of SFNC", COUNT),
        shown("DeviceSFNCVersionMinor", "Version of SFNC", COUNT),
        shown("DeviceSFNCVersionSubMinor", "Version of SFNC", COUNT),
        free("TimestampLatch", "Keeps the present time", Kind::Command),
        shown("TimestampLatchValue", "The time that was kept, ns since 1970", COUNT),
    ];
    let image = vec![
        shown("WidthMax", "Columns of the whole frame", COUNT),
        shown("HeightMax", "Rows of the whole frame", COUNT),
        shown("SheetlightWidthLimit", "Most columns from the present offset on", COUNT),
        shown("SheetlightHeightLimit", "Most rows from the present offset on", COUNT),
        shown("SheetlightOffsetXLimit", "Greatest offset at the present width", COUNT),
        shown("SheetlightOffsetYLimit", "Greatest offset at the present height", COUNT),
        set("Width", "Columns of a frame", pixels("SheetlightWidthLimit")),
        set("Height", "Rows of a frame", pixels("SheetlightHeightLimit")),
        set("OffsetX", "First column of a frame", offset("SheetlightOffsetXLimit")),
        set("OffsetY", "First row of a frame", offset("SheetlightOffsetYLimit")),
        free("ComponentSelector", "The component to set", Kind::Choice(COMPONENTS)).selecting(&[
            "ComponentEnable",
            "ComponentIDValue",
            "PixelFormat",
        ]),
        set("ComponentEnable", "Whether frames have the component", Kind::Boolean),
        shown("ComponentIDValue", "Number of the component", COUNT),
        set("PixelFormat", "Format of the component", Kind::Choice(FORMATS)),
    ];
    let trigger_on = Kind::Choice(const { &[choice("Off", 0), choice("On", 1)] });
    let trigger_by = Kind::Choice(const { &[choice("Software", 0), choice("NewScan", 1)] });
    let rate = Kind::Float { least: 0.001, most: 10_000.0, unit: "Hz" };
    let acquisition =
        vec![
            set("AcquisitionMode", "When an acquisition ends", Kind::Choice(MODES)),
            set("AcquisitionFrameCount", "Frames of MultiFrame", Kind::Integer { least: 1, most: Most::Is(1 << 32) }),
            set("AcquisitionFrameRate", "Most frames a second without a trigger", rate),
            free("AcquisitionStart", "Starts the frames", Kind::Command),
            free("AcquisitionStop", "Ends the frames", Kind::Command),
            free("TriggerSelector", "The trigger to set", Kind::Choice(const { &[choice("FrameStart", 0)] }))
                .selecting(&["TriggerMode", "TriggerSource", "TriggerSoftware"]),
            set("TriggerMode", "Whether a frame waits for its trigger", trigger_on),
            set("TriggerSource", "What triggers a frame", trigger_by),
            free("TriggerSoftware", "Triggers one frame", Kind::Command),
        ];
    let fixed = |name, about, value| shown(name, about, Kind::Choice(value));
    let scan = vec![
        fixed("Scan3dDistanceUnit", "Unit of coordinates", const { &[choice("Millimeter", 0)] }),
        fixed("Scan3dCoordinateSystem", "Kind of coordinates", const { &[choice("Cartesian", 0)] }),
        fixed("Scan3dCoordinateSystemReference", "The system that is used", const { &[choice("Anchor", 0)] }),
        set("Scan3dOutputMode", "What the range is", Kind::Choice(OUTPUTS)),
        free("Scan3dCoordinateSelector", "The coordinate to read", Kind::Choice(AXES)).selecting(&[
            "Scan3dCoordinateScale",
            "Scan3dCoordinateOffset",
            "Scan3dInvalidDataFlag",
            "Scan3dInvalidDataValue",
            "Scan3dAxisMin",
            "Scan3dAxisMax",
        ]),
        shown("Scan3dCoordinateScale", "Millimetres of one step of the coordinate", LENGTH),
        shown("Scan3dCoordinateOffset", "Millimetres at the coordinate's value 0", LENGTH),
        shown("Scan3dInvalidDataFlag", "Whether a value marks what was not measured", Kind::Boolean),
        shown("Scan3dInvalidDataValue", "The value that marks it", LENGTH),
        shown("Scan3dAxisMin", "Least coordinate", LENGTH),
        shown("Scan3dAxisMax", "Greatest coordinate", LENGTH),
        free("Scan3dCoordinateReferenceSelector", "The number to read of the pose", Kind::Choice(REFERENCES))
            .selecting(&["Scan3dCoordinateReferenceValue"]),
        shown(
            "Scan3dCoordinateReferenceValue",
            "Pose of the coordinates in SheetlightFrame: turned about X, Y, Z in degrees, then moved in mm",
            Kind::Float { least: f32::MIN as f64, most: f32::MAX as f64, unit: "" },
        ),
    ];
    let half = Kind::Float { least: 1e-6, most: 1e3, unit: "mm" };
    let ours = vec![
        shown("SheetlightFrame", "Frame of the coordinates: base, axis, flange or map", Kind::Text),
        set("SheetlightConfidenceHalfSigma", "Standard deviation with half of the greatest confidence", half),
        shown("SheetlightLastFault", "Why the last frame could not be made", Kind::Text),
    ];
    let transport = vec![
        shown("PayloadSize", "Bytes of a frame", COUNT),
        free("TLParamsLocked", "1 while an acquisition runs", Kind::Integer { least: 0, most: Most::Is(1) }),
    ];
    Table {
        module: "Device3D",
        categories: vec![
            category("DeviceControl", device),
            category("ImageFormatControl", image),
            category("AcquisitionControl", acquisition),
            category("Scan3dControl", scan),
            category("TransportLayerControl", transport),
            category("SheetlightControl", ours),
        ],
    }
}
