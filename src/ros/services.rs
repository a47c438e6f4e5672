//! What a node answers: the six parameter services, `~/reset`, `/clock` with
//! `use_sim_time`, and its own echo. They run in one thread beside the images.
//!
//! `ros2_client` has parameter services and a clock of its own. They describe
//! nothing, use one service mapping only and subscribe `/clock` with a wrong
//! type, so they are left off.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use futures::channel::oneshot;
use futures::future::{Either, select};
use futures::stream::{BoxStream, SelectAll, StreamExt};
use ros2_client::{ReadResult, RmwRequestId};

use crate::ros::echo::EchoListener;
use crate::ros::endpoint::{Publisher, Server, Subscription};
use crate::ros::message::Message;
use crate::ros::message::rcl_interfaces::{
    DescribeParametersRequest, DescribeParametersResponse, GetParameterTypesRequest,
    GetParameterTypesResponse, GetParametersRequest, GetParametersResponse, ListParametersRequest,
    ListParametersResponse, Parameter, ParameterEvent, SetParametersAtomicallyRequest,
    SetParametersAtomicallyResponse, SetParametersRequest, SetParametersResponse,
    SetParametersResult,
};
use crate::ros::message::rosgraph_msgs::Clock;
use crate::ros::message::std_srvs::{TriggerRequest, TriggerResponse};
use crate::ros::node::{NodeError, RosNode};
use crate::ros::params::{self, ParameterStore};
use crate::ros::qos;
use crate::ros::time::NodeClock;

/// What the services act upon.
pub struct Targets {
    /// The parameters.
    pub store: Arc<ParameterStore>,
    /// The node's time.
    pub clock: Arc<NodeClock>,
    /// Counts the calls of `~/reset`; whoever drives the pipeline looks at it
    /// at each frame boundary.
    pub resets: Arc<AtomicU64>,
    /// The node's messages to itself, where it sends any.
    pub echo: Option<EchoListener>,
}

/// The endpoints of the services.
pub struct Services {
    node: RosNode,
    targets: Targets,
    full_name: String,
    clock_topic: String,
    get: Server<GetParametersRequest, GetParametersResponse>,
    get_types: Server<GetParameterTypesRequest, GetParameterTypesResponse>,
    list: Server<ListParametersRequest, ListParametersResponse>,
    set: Server<SetParametersRequest, SetParametersResponse>,
    set_atomically: Server<SetParametersAtomicallyRequest, SetParametersAtomicallyResponse>,
    describe: Server<DescribeParametersRequest, DescribeParametersResponse>,
    reset: Server<TriggerRequest, TriggerResponse>,
    events: Publisher<ParameterEvent>,
}

enum Event {
    Get(ReadResult<(RmwRequestId, GetParametersRequest)>),
    GetTypes(ReadResult<(RmwRequestId, GetParameterTypesRequest)>),
    List(ReadResult<(RmwRequestId, ListParametersRequest)>),
    Set(ReadResult<(RmwRequestId, SetParametersRequest)>),
    SetAtomically(ReadResult<(RmwRequestId, SetParametersAtomicallyRequest)>),
    Describe(ReadResult<(RmwRequestId, DescribeParametersRequest)>),
    Reset(ReadResult<(RmwRequestId, TriggerRequest)>),
    Clock(Clock),
    Echo(i32),
}

impl Services {
    /// Offers the services of `node`, which stays on the graph as long as they do.
    ///
    /// # Errors
    /// When an endpoint is refused.
    pub fn new(mut node: RosNode, targets: Targets) -> Result<Self, NodeError> {
        let full_name = node.names().full_name();
        let at = |node: &RosNode, name: &str| {
            let private = format!("~/{name}");
            node.names().service(&private).map_err(|e| NodeError::Endpoint {
                what: "service",
                name: private,
                reason: e.to_string(),
            })
        };
        let clock_topic = node.names().topic("/clock").unwrap_or_else(|_| "/clock".to_owned());
        let get = at(&node, "get_parameters").and_then(|name| node.serve(&name))?;
        let get_types = at(&node, "get_parameter_types").and_then(|name| node.serve(&name))?;
        let list = at(&node, "list_parameters").and_then(|name| node.serve(&name))?;
        let set = at(&node, "set_parameters").and_then(|name| node.serve(&name))?;
        let set_atomically =
            at(&node, "set_parameters_atomically").and_then(|name| node.serve(&name))?;
        let describe = at(&node, "describe_parameters").and_then(|name| node.serve(&name))?;
        let reset = at(&node, "reset").and_then(|name| node.serve(&name))?;
        let events = node.advertise("/parameter_events", &qos::parameter_events())?;
        Ok(Self {
            node,
            targets,
            full_name,
            clock_topic,
            get,
            get_types,
            list,
            set,
            set_atomically,
            describe,
            reset,
            events,
        })
    }

    /// Answers until `stop` is sent or dropped, then leaves the graph.
    pub fn run(mut self, mut stop: oneshot::Receiver<()>) {
        let all = self
            .targets
            .store
            .config()
            .flatten()
            .into_iter()
            .map(|(name, value)| Parameter { name: name.to_owned(), value: params::to_ros(&value) })
            .collect();
        self.announce(ParameterEvent { new_parameters: all, ..Default::default() });
        // The subscription of /clock comes and goes with use_sim_time; each
        // change leaves the inner loop.
        loop {
            let simulated = self.targets.store.config().use_sim_time;
            self.targets.clock.simulate(simulated);
            let time = if simulated { self.subscribe_clock() } else { None };
            match futures::executor::block_on(self.answer(time.as_ref(), simulated, stop)) {
                Some(unused) => stop = unused,
                None => return,
            }
        }
    }

    fn subscribe_clock(&mut self) -> Option<Subscription<Clock>> {
        match self.node.subscribe(&self.clock_topic, &qos::clock()) {
            Ok(subscription) => Some(subscription),
            Err(error) => {
                tracing::error!("use_sim_time: {error}");
                None
            }
        }
    }

    /// Answers until stopped (`None`) or until `use_sim_time` is no longer `simulated`.
    async fn answer(
        &self,
        time: Option<&Subscription<Clock>>,
        simulated: bool,
        mut stop: oneshot::Receiver<()>,
    ) -> Option<oneshot::Receiver<()>> {
        let mut events: SelectAll<BoxStream<'_, Event>> = SelectAll::new();
        events.push(requests(&self.get, Event::Get));
        events.push(requests(&self.get_types, Event::GetTypes));
        events.push(requests(&self.list, Event::List));
        events.push(requests(&self.set, Event::Set));
        events.push(requests(&self.set_atomically, Event::SetAtomically));
        events.push(requests(&self.describe, Event::Describe));
        events.push(requests(&self.reset, Event::Reset));
        if let Some(time) = time {
            let stream = time.async_stream().filter_map(|received| async {
                received.ok().map(|(clock, _)| Event::Clock(clock))
            });
            events.push(stream.boxed());
        }
        if let Some(echo) = &self.targets.echo {
            events.push(echo.numbers().map(Event::Echo).boxed());
        }
        loop {
            let event = match select(stop, events.next()).await {
                Either::Left(_) => return None,
                Either::Right((event, unused)) => {
                    stop = unused;
                    event?
                }
            };
            self.handle(event);
            if self.targets.store.config().use_sim_time != simulated {
                return Some(stop);
            }
        }
    }

    fn handle(&self, event: Event) {
        let store = &self.targets.store;
        match event {
            Event::Clock(Clock { clock }) => self.targets.clock.set(clock.into()),
            Event::Echo(number) => {
                if let Some(echo) = &self.targets.echo {
                    echo.hear(number);
                }
            }
            Event::Get(request) => respond(&self.get, request, |request| GetParametersResponse {
                values: request.names.iter().map(|name| store.get(name)).collect(),
            }),
            Event::GetTypes(request) => {
                respond(&self.get_types, request, |request| GetParameterTypesResponse {
                    types: request.names.iter().map(|name| store.get(name).r#type).collect(),
                });
            }
            Event::List(request) => respond(&self.list, request, |request| {
                ListParametersResponse { result: params::list(&request.prefixes, request.depth) }
            }),
            Event::Describe(request) => {
                respond(&self.describe, request, |request| DescribeParametersResponse {
                    descriptors: request.names.iter().map(|n| params::descriptor(n)).collect(),
                });
            }
            Event::Set(request) => respond(&self.set, request, |request| SetParametersResponse {
                results: request
                    .parameters
                    .iter()
                    .map(|parameter| self.change(std::slice::from_ref(parameter)))
                    .collect(),
            }),
            Event::SetAtomically(request) => {
                respond(&self.set_atomically, request, |request| SetParametersAtomicallyResponse {
                    result: self.change(&request.parameters),
                });
            }
            Event::Reset(request) => respond(&self.reset, request, |_| {
                self.targets.resets.fetch_add(1, Ordering::AcqRel);
                tracing::info!("reset: the previous frame and all tracks are forgotten");
                TriggerResponse { success: true, message: "the next frame starts anew".to_owned() }
            }),
        }
    }

    fn change(&self, parameters: &[Parameter]) -> SetParametersResult {
        let before = self.targets.store.generation();
        match self.targets.store.set(parameters) {
            Ok(()) => {
                if self.targets.store.generation() != before {
                    for Parameter { name, .. } in parameters {
                        let value = self.targets.store.config().value(name).unwrap_or_default();
                        tracing::info!("parameter {name} = {value}");
                    }
                    let changed_parameters = parameters
                        .iter()
                        .map(|Parameter { name, .. }| Parameter {
                            name: name.clone(),
                            value: self.targets.store.get(name),
                        })
                        .collect();
                    self.announce(ParameterEvent { changed_parameters, ..Default::default() });
                }
                SetParametersResult { successful: true, reason: String::new() }
            }
            Err(reason) => {
                tracing::warn!("refused: {reason}");
                SetParametersResult { successful: false, reason }
            }
        }
    }

    fn announce(&self, event: ParameterEvent) {
        let event = ParameterEvent {
            stamp: self.targets.clock.now().into(),
            node: self.full_name.clone(),
            ..event
        };
        if let Err(error) = self.events.publish(event) {
            tracing::debug!("/parameter_events: {error}");
        }
    }
}

fn requests<Req, Resp>(
    server: &Server<Req, Resp>,
    event: fn(ReadResult<(RmwRequestId, Req)>) -> Event,
) -> BoxStream<'_, Event>
where
    Req: Message + Send + Sync + 'static,
    Resp: Message + Send + Sync + 'static,
{
    server.receive_request_stream().map(event).boxed()
}

fn respond<Req, Resp>(
    server: &Server<Req, Resp>,
    request: ReadResult<(RmwRequestId, Req)>,
    answer: impl FnOnce(&Req) -> Resp,
) where
    Req: Message + Send + Sync + 'static,
    Resp: Message + Send + Sync + 'static,
{
    match request {
        Ok((id, request)) => {
            if let Err(error) = server.send_response(id, answer(&request)) {
                tracing::warn!("{}: the response was not sent: {error}", Req::TYPE_NAME);
            }
        }
        Err(error) => tracing::warn!("{}: request left out: {error}", Req::TYPE_NAME),
    }
}
