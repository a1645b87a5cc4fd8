//! In: values and events of the vision system. Out: changed values at its nodes, events at its subscribers.
//! Frame and unit: those of the values.

use crate::model::ids::{Row, STATES, kind, transition_of};
use crate::model::system::Spaces;
use crate::node::Manager;
use opcua::nodes::{BaseEventType, Event};
use opcua::server::SubscriptionCache;
use opcua::types::event_field::EventField;
use opcua::types::{
    AttributeId, ByteString, DataValue, DateTime, LocalizedText, NodeId, NumericRange, QualifiedName, StatusCode,
    Variant,
};
use std::collections::HashMap;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// A value of the vision system.
pub enum Value {
    State { outer: bool, state: Option<u32> },
    Transition { outer: bool, by: Option<u32> },
    Shown { name: &'static str, value: Variant },
    Result { name: &'static str, value: Variant },
}

/// An event of the vision system.
pub struct Told {
    kind: u32,
    message: String,
    fields: Vec<(&'static str, Variant)>,
    row: Option<&'static Row>,
}

impl Told {
    pub fn new(kind: u32, message: String) -> Told {
        Told { kind, message, fields: vec![], row: None }
    }

    pub fn with(mut self, name: &'static str, value: impl Into<Variant>) -> Told {
        self.fields.push((name, value.into()));
        self
    }

    /// A machine changes its state.
    pub fn transition(row: &'static Row) -> Told {
        Told { row: Some(row), ..Told::new(kind::STATE_CHANGED, row.name.to_owned()) }
    }
}

/// An event as subscribers see it.
struct Seen {
    base: BaseEventType,
    fields: Vec<(&'static str, Variant)>,
}

impl EventField for Seen {
    fn get_value(&self, attribute: AttributeId, range: &NumericRange, path: &[QualifiedName]) -> Variant {
        let base = self.base.get_value(attribute, range, path);
        if base != Variant::Empty || attribute != AttributeId::Value {
            return base;
        }
        // A field of a field, such as the identifier of a state, is named by both.
        let name = path.iter().map(|q| q.name.as_ref()).collect::<Vec<_>>().join("/");
        let found = self.fields.iter().find(|(field, _)| *field == name);
        found.map_or(Variant::Empty, |(_, value)| value.clone())
    }
}

impl Event for Seen {
    fn get_field(
        &self,
        _type: &NodeId,
        attribute: AttributeId,
        range: &NumericRange,
        path: &[QualifiedName],
    ) -> Variant {
        self.get_value(attribute, range, path)
    }

    fn time(&self) -> &DateTime {
        &self.base.time
    }

    fn event_type_id(&self) -> &NodeId {
        &self.base.event_type
    }
}

/// The nodes and the subscribers.
pub struct Outlet {
    manager: Arc<Manager>,
    subscriptions: Arc<SubscriptionCache>,
    spaces: Spaces,
    /// What was shown last.
    last: Mutex<HashMap<NodeId, Result<Variant, StatusCode>>>,
    events: AtomicU64,
}

fn state_of(id: u32) -> (&'static str, u32) {
    STATES.iter().find(|s| s.id == id).map(|s| (s.name, s.number)).expect("the numbers of this table")
}

impl Outlet {
    pub fn new(manager: Arc<Manager>, subscriptions: Arc<SubscriptionCache>, spaces: Spaces) -> Outlet {
        // Events of this start differ from those of another one.
        let events = AtomicU64::new(DateTime::now().ticks() as u64);
        Outlet { manager, subscriptions, spaces, last: Mutex::default(), events }
    }

    /// The nodes of a value with what they show.
    fn nodes(&self, value: Value, to: &mut Vec<(NodeId, Result<Variant, StatusCode>)>) {
        let spaces = &self.spaces;
        let mut three = |outer: bool, what: &str, all: Option<(u32, &str, u32)>| {
            let at = |name: String| spaces.machine(outer, &name);
            let good = |v: Variant| all.map(|_| v).ok_or(StatusCode::BadStateNotActive);
            let (id, name, number) = all.unwrap_or((0, "", 0));
            to.push((at(what.into()), good(LocalizedText::new("en", name).into())));
            to.push((at(format!("{what}.Id")), good(NodeId::new(spaces.vision, id).into())));
            to.push((at(format!("{what}.Number")), good(number.into())));
        };
        match value {
            Value::State { outer, state } => {
                let all = state.map(|id| {
                    let (name, number) = state_of(id);
                    (id, name, number)
                });
                three(outer, "CurrentState", all);
            }
            Value::Transition { outer, by } => {
                let all = by.map(transition_of).map(|row| (row.id, row.name, row.number));
                three(outer, "LastTransition", all);
            }
            Value::Shown { name, value } => to.push((spaces.shown(name), Ok(value))),
            Value::Result { name, value } => to.push((spaces.result(name), Ok(value))),
        }
    }

    /// Shows values and tells events.
    pub fn show(&self, values: Vec<Value>, told: Vec<Told>) {
        let mut all = Vec::new();
        values.into_iter().for_each(|value| self.nodes(value, &mut all));
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        all.retain(|(id, value)| last.get(id) != Some(value));
        let now = DateTime::now();
        let changed = all.iter().map(|(id, value)| {
            let (value, status) = match value {
                Ok(value) => (Some(value.clone()), StatusCode::Good),
                Err(status) => (None, *status),
            };
            let data = DataValue {
                value,
                status: Some(status),
                source_timestamp: Some(now),
                server_timestamp: Some(now),
                ..DataValue::default()
            };
            (id, None, data)
        });
        // All nodes are there: they were inserted with the same names.
        let _ = self.manager.set_values(&self.subscriptions, changed);
        last.extend(all);
        drop(last);
        for told in told {
            self.tell(told);
        }
    }

    fn tell(&self, told: Told) {
        let number = self.events.fetch_add(1, Ordering::Relaxed);
        let id = ByteString::from(number.to_be_bytes().to_vec());
        let kind = NodeId::new(self.spaces.vision, told.kind);
        let mut base = BaseEventType::new_now(kind, id, told.message.as_str());
        base.source_node = self.spaces.system();
        base.source_name = crate::model::system::SYSTEM.into();
        base.severity = 300;
        let mut fields = told.fields;
        if let Some(row) = told.row {
            let state = |id: u32| LocalizedText::new("en", state_of(id).0);
            let node = |id: u32| NodeId::new(self.spaces.vision, id);
            base.source_node = self.spaces.machine_itself(row.vision);
            fields.extend([
                ("Transition", LocalizedText::new("en", row.name).into()),
                ("Transition/Id", node(row.id).into()),
                ("FromState", state(row.from).into()),
                ("FromState/Id", node(row.from).into()),
                ("ToState", state(row.to).into()),
                ("ToState/Id", node(row.to).into()),
            ]);
        }
        let seen = Seen { base, fields };
        // Who subscribes to the server object gets it too.
        let system = self.spaces.system();
        self.subscriptions.notify_events(std::iter::once((&seen as &dyn Event, &system)));
    }
}
