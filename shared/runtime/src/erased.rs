//! Ports that treat messages as bytes, and whose message types are known only at run time.
//!
//! The types of a topic are described by values here. iceoryx2 is therefore compiled only once, in this crate, instead of in every crate
//! for every message type.
//!
//! iceoryx2 offers this interface to its bindings for other languages. A topic is opened with the names, sizes and alignments of its types.
//! As with types known to the compiler, this fails if they differ from the types with which the topic was created.
#![expect(
    unsafe_code,
    reason = "iceoryx2 hands out bytes, and takes the types of a topic on trust"
)]

use core::any::TypeId;

use iceoryx2::port::LoanError;
use iceoryx2::port::publisher::Publisher;
use iceoryx2::port::subscriber::Subscriber;
use iceoryx2::port::{ReceiveError, SendError};
use iceoryx2::prelude::{Node, Service, ServiceName, ipc};
use iceoryx2::sample::Sample;
use iceoryx2::sample_mut::SampleMut;
use iceoryx2::service::builder::publish_subscribe::Builder;
use iceoryx2::service::marker::{CustomHeaderMarker, CustomPayloadMarker};
use iceoryx2::service::port_factory::publish_subscribe::PortFactory;
use iceoryx2::service::static_config::message_type_details::{TypeDetail, TypeVariant};

use crate::payload::{Element, Header, Message};

/// The payload of every topic, as bytes.
pub(crate) type Bytes = [CustomPayloadMarker];
/// The header of every topic, without its type.
pub(crate) type Head = CustomHeaderMarker;

/// The messages of a topic in one process.
pub(crate) type Messages<S = ipc::Service> = PortFactory<S, Bytes, Head>;

/// The types of a topic: its elements, and the header before them.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Types {
    element: TypeDetail,
    header: TypeDetail,
    ids: Ids,
    name: &'static str,
}

/// The types of a topic, as type ids of this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Ids {
    element: TypeId,
    header: TypeId,
}

impl Types {
    /// Returns the types of a topic of arrays of `E` with the header `H`.
    pub(crate) fn new<E: Message, H: Header>() -> Self {
        Self {
            element: TypeDetail::new::<E>(TypeVariant::Dynamic),
            header: TypeDetail::new::<H>(TypeVariant::FixedSize),
            ids: Ids {
                element: TypeId::of::<E>(),
                header: TypeId::of::<H>(),
            },
            name: core::any::type_name::<(H, [E; 0])>(),
        }
    }

    /// Returns the names of both types, for users.
    pub(crate) fn name(&self) -> &'static str {
        self.name
    }

    /// Returns a builder that creates or opens a topic of these types.
    pub(crate) fn builder<S: Service>(
        &self,
        node: &Node<S>,
        name: &ServiceName,
    ) -> Builder<Bytes, Head, S> {
        let builder = node.service_builder(name).publish_subscribe::<Bytes>().user_header::<Head>();
        // SAFETY: chunks of the topic are read and written only as these types. Every port below keeps the types and checks them.
        let builder = unsafe { builder.__internal_set_payload_type_details(&self.element) };
        // SAFETY: as above.
        unsafe { builder.__internal_set_user_header_type_details(&self.header) }
    }
}

/// Sends chunks of a topic.
#[derive(Debug)]
pub(crate) struct Writer {
    port: Publisher<ipc::Service, Bytes, Head>,
    ids: Ids,
}

impl Writer {
    /// Creates a writer.
    ///
    /// * `port`: publisher of a topic that was opened with `types`.
    pub(crate) fn new(port: Publisher<ipc::Service, Bytes, Head>, types: &Types) -> Self {
        Self {
            port,
            ids: types.ids,
        }
    }

    pub(crate) fn port(&self) -> &Publisher<ipc::Service, Bytes, Head> {
        &self.port
    }

    /// Loans a chunk of `len` elements. The chunk and its header contain the values of an earlier message.
    pub(crate) fn loan(&self, len: usize) -> Result<Chunk, LoanError> {
        // SAFETY: all topics of this module are of arrays, which may have any length.
        let sample = unsafe { self.port.loan_custom_payload(len) }?;
        // SAFETY: the bytes belong to a mapped file. The kernel zeroed them and senders have written to them since, so they are
        // initialised. Every bit pattern is a value of a byte.
        let sample = unsafe { sample.assume_init() };
        Ok(Chunk {
            sample,
            ids: self.ids,
        })
    }
}

/// A chunk that can be written and sent.
#[derive(Debug)]
pub(crate) struct Chunk {
    sample: SampleMut<ipc::Service, Bytes, Head>,
    ids: Ids,
}

impl Chunk {
    /// Copies a message into a chunk of one element.
    pub(crate) fn write<T: Message>(&mut self, message: &T) {
        self.check::<T, ()>();
        let to = self.sample.payload_mut().as_mut_ptr().cast::<T>();
        // SAFETY: the chunk is one `T`, with the alignment of `T`.
        unsafe { to.write(*message) };
    }

    /// Sets the header to its default value.
    pub(crate) fn write_header<E: Message, H: Header>(&mut self) {
        self.check::<E, H>();
        let to = core::ptr::from_mut(self.sample.user_header_mut());
        let to = core::ptr::with_exposed_provenance_mut::<H>(to.expose_provenance());
        // SAFETY: the header is of the type `H`. iceoryx2 computes its address as a number from that of the segment. This
        // exposes the provenance of the segment.
        unsafe { to.write(H::default()) };
    }

    pub(crate) fn payload_mut<E: Element, H: Header>(&mut self) -> &mut [E] {
        self.check::<E, H>();
        let bytes = self.sample.payload_mut();
        let len = bytes.len() / size_of::<E>();
        // SAFETY: these are `len` elements of the type `E`, with its alignment. Every bit pattern is a value of `E` (its trait is
        // sealed).
        unsafe { core::slice::from_raw_parts_mut(bytes.as_mut_ptr().cast(), len) }
    }

    /// Returns the header of a chunk for which [`Self::write_header`] was called.
    pub(crate) fn header_mut<E: Message, H: Header>(&mut self) -> &mut H {
        self.check::<E, H>();
        let at = core::ptr::from_mut(self.sample.user_header_mut());
        let at = core::ptr::with_exposed_provenance_mut::<H>(at.expose_provenance());
        // SAFETY: the header is of the type `H` and has a value; its provenance is exposed, as above.
        unsafe { &mut *at }
    }

    pub(crate) fn send(self) -> Result<usize, SendError> {
        self.sample.send()
    }

    fn check<E: Message, H: Header>(&self) {
        check::<E, H>(self.ids);
    }
}

/// Receives chunks of a topic.
#[derive(Debug)]
pub(crate) struct Reader<S: Service = ipc::Service> {
    port: Subscriber<S, Bytes, Head>,
    ids: Ids,
}

impl<S: Service> Reader<S> {
    /// Creates a reader.
    ///
    /// * `port`: subscriber of a topic that was opened with `types`.
    pub(crate) fn new(port: Subscriber<S, Bytes, Head>, types: &Types) -> Self {
        Self {
            port,
            ids: types.ids,
        }
    }

    pub(crate) fn port(&self) -> &Subscriber<S, Bytes, Head> {
        &self.port
    }

    pub(crate) fn receive(&self) -> Result<Option<Received<S>>, ReceiveError> {
        let sample = self.port.receive()?;
        Ok(sample.map(|sample| Received {
            sample,
            ids: self.ids,
        }))
    }
}

/// A chunk that was received.
#[derive(Debug)]
pub(crate) struct Received<S: Service = ipc::Service> {
    sample: Sample<S, Bytes, Head>,
    ids: Ids,
}

impl<S: Service> Received<S> {
    pub(crate) fn payload<E: Message, H: Header>(&self) -> &[E] {
        check::<E, H>(self.ids);
        let bytes = self.sample.payload();
        let len = bytes.len() / size_of::<E>();
        // SAFETY: these are `len` elements of the type `E`, with its alignment, that a sender of the same type has written.
        unsafe { core::slice::from_raw_parts(bytes.as_ptr().cast(), len) }
    }

    pub(crate) fn header<E: Message, H: Header>(&self) -> &H {
        check::<E, H>(self.ids);
        let at = core::ptr::from_ref(self.sample.user_header());
        let at = core::ptr::with_exposed_provenance::<H>(at.expose_provenance());
        // SAFETY: the header is of the type `H`, and its sender has given it a value. iceoryx2 computes its address as a number
        // from that of the segment. This exposes the provenance of the segment.
        unsafe { &*at }
    }
}

/// Checks that a chunk is read or written as its own type. Only an error in this crate can make the check fail.
fn check<E: Message, H: Header>(ids: Ids) {
    const { assert!(size_of::<E>() > 0) };
    let asked = Ids {
        element: TypeId::of::<E>(),
        header: TypeId::of::<H>(),
    };
    assert_eq!(
        asked, ids,
        "a topic is used with types that it does not have"
    );
}
