//! In: the server's address space. Out: the nodes of the vision system in it; their methods call the vision system.
//! Frame and unit: none.

use crate::model::ids::{OWN, VISION};
use crate::model::system::Spaces;
use crate::model::types;
use crate::vision::Vision;
use async_trait::async_trait;
use opcua::server::address_space::{AddressSpace, add_namespaces};
use opcua::server::diagnostics::NamespaceMetadata;
use opcua::server::node_manager::memory::{
    InMemoryNodeManager, InMemoryNodeManagerBuilder, InMemoryNodeManagerImpl, InMemoryNodeManagerImplBuilder,
};
use opcua::server::node_manager::{MethodCall, NodeManagerBuilder, RequestContext, ServerContext, WriteNode};
use opcua::sync::RwLock;
use opcua::types::StatusCode;
use std::sync::Arc;

/// The nodes with what stands behind them.
pub type Manager = InMemoryNodeManager<Nodes>;

/// What stands behind the nodes.
pub struct Nodes {
    vision: Arc<Vision>,
    pub spaces: Spaces,
}

struct Builds(Arc<Vision>);

impl InMemoryNodeManagerImplBuilder for Builds {
    type Impl = Nodes;

    fn build(self, context: ServerContext, space: &mut AddressSpace) -> Nodes {
        let indices = add_namespaces(&context, space, &[VISION, OWN]);
        let spaces = Spaces { vision: indices[0], own: indices[1] };
        types::insert(space, spaces.vision);
        spaces.insert(space);
        Nodes { vision: self.0, spaces }
    }
}

/// Makes the nodes.
pub fn nodes(vision: Arc<Vision>) -> impl NodeManagerBuilder {
    InMemoryNodeManagerBuilder::new(Builds(vision))
}

#[async_trait]
impl InMemoryNodeManagerImpl for Nodes {
    async fn init(&self, _space: &mut AddressSpace, _context: ServerContext) {}

    fn name(&self) -> &str {
        "vision"
    }

    fn namespaces(&self) -> Vec<NamespaceMetadata> {
        let named = |uri: &str, index: u16, subset: bool| NamespaceMetadata {
            namespace_uri: uri.to_owned(),
            namespace_index: index,
            is_namespace_subset: Some(subset),
            ..NamespaceMetadata::default()
        };
        vec![named(VISION, self.spaces.vision, true), named(OWN, self.spaces.own, false)]
    }

    /// Nothing is written: what changes the station is a method.
    async fn write(
        &self,
        _context: &RequestContext,
        _space: &RwLock<AddressSpace>,
        nodes: &mut [&mut WriteNode],
    ) -> Result<(), StatusCode> {
        nodes.iter_mut().for_each(|node| node.set_status(StatusCode::BadNotWritable));
        Ok(())
    }

    async fn call(
        &self,
        _context: &RequestContext,
        _space: &RwLock<AddressSpace>,
        calls: &mut [&mut &mut MethodCall],
    ) -> Result<(), StatusCode> {
        for call in calls {
            let name = self.spaces.method(call.method_id()).map(str::to_owned);
            // A type's method is called at the object, not at the type.
            let Some(name) = name else {
                call.set_status(StatusCode::BadMethodInvalid);
                continue;
            };
            match self.vision.call(&name, call.arguments()).await {
                Ok(given) => {
                    call.set_outputs(given);
                    call.set_status(StatusCode::Good);
                }
                Err(status) => call.set_status(status),
            }
        }
        Ok(())
    }
}
