//! The running node: its threads, from the first subscription to the last
//! message.
//!
//! ```text
//! input thread -> mailbox (newest pair wins) -> pipeline thread -> mailbox -> output thread
//! ```
//!
//! The pipeline thread lives in a pool of its own and is never made to wait:
//! what the output thread cannot take is replaced by the next result. A fourth
//! thread answers the services, a fifth measures the alignment of the cameras.

mod align;
mod work;

use std::sync::atomic::AtomicU64;
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex};
use std::thread;
use std::time::{Duration, Instant};

use futures::channel::oneshot;
use thiserror::Error;

use crate::config::Config;
use crate::drive::{DriveError, worker_pool};
use crate::input::Observation;
use crate::input::live::{LiveInput, LiveInputError};
use crate::mailbox::Mailbox;
use crate::output::live::LiveOutput;
use crate::perception::Perception;
use crate::ros::diagnostics::NodeStatus;
use crate::ros::echo::echo;
use crate::ros::environment::{Environment, Middleware};
use crate::ros::log;
use crate::ros::names::Names;
use crate::ros::node::{Graph, NodeError, RosNode, receive_buffer_advice};
use crate::ros::params::ParameterStore;
use crate::ros::qos::{self, QosOverrides};
use crate::ros::services::{Services, Targets};
use crate::ros::time::NodeClock;
use crate::stamp::Stamp;

/// Longest that [`NodeRuntime::stop`] waits for the threads.
const STOP_PATIENCE: Duration = Duration::from_secs(5);

/// What keeps the node from running.
#[derive(Debug, Error)]
pub enum RuntimeError {
    /// The graph.
    #[error(transparent)]
    Node(#[from] NodeError),
    /// The input topics.
    #[error(transparent)]
    Input(#[from] LiveInputError),
    /// The workers of the pipeline.
    #[error(transparent)]
    Workers(#[from] DriveError),
    /// A thread.
    #[error("cannot start the {name} thread: {source}")]
    Thread {
        /// Which one.
        name: &'static str,
        /// Why.
        source: std::io::Error,
    },
}

/// Sees each frame and its result after they were published.
pub type Observer = Box<dyn FnMut(&Observation, &Perception) + Send>;

/// How a node is to run.
pub struct NodeOptions {
    /// Parameters at start.
    pub config: Config,
    /// Names of the node and its topics.
    pub names: Names,
    /// Domain and networks.
    pub environment: Environment,
    /// What replaces the node's own quality of service.
    pub qos_overrides: QosOverrides,
    /// Log to `/rosout`.
    pub rosout: bool,
    /// Sees each result, in the output thread.
    pub observer: Option<Observer>,
    /// Results that may wait for the output thread, at least one; more only
    /// for an observer that must miss none.
    pub results_waiting: usize,
}

impl NodeOptions {
    /// Options without observer.
    pub fn new(config: Config, names: Names, environment: Environment) -> Self {
        Self {
            config,
            names,
            environment,
            qos_overrides: QosOverrides::default(),
            rosout: true,
            observer: None,
            results_waiting: 2,
        }
    }
}

/// A running node. Dropping it stops it.
pub struct NodeRuntime {
    status: Arc<NodeStatus>,
    store: Arc<ParameterStore>,
    names: Names,
    clock: Arc<NodeClock>,
    graph: Option<Graph>,
    regions_topic: String,
    stop: Vec<oneshot::Sender<()>>,
    ended: Receiver<&'static str>,
    running: usize,
    rosout: bool,
}

impl NodeRuntime {
    /// Joins the graph and starts the threads.
    ///
    /// # Errors
    /// When sockets, topics or threads are refused; nothing runs then.
    pub fn start(options: NodeOptions) -> Result<Self, RuntimeError> {
        let NodeOptions {
            config,
            names,
            environment,
            qos_overrides,
            rosout,
            observer,
            results_waiting,
        } = options;
        for note in &environment.notes {
            tracing::warn!("{note}");
        }
        log::mute_transport(false);
        let mut node = RosNode::open(names.clone(), &environment)?;
        node.override_qos(qos_overrides);
        let clock = Arc::new(NodeClock::default());
        clock.simulate(config.use_sim_time);
        if rosout {
            let publisher = node.advertise("/rosout", &qos::rosout())?;
            log::connect_rosout(publisher, names.logger(), Arc::clone(&clock));
        }
        if let Some(advice) = node.receive_buffer_bytes().and_then(receive_buffer_advice) {
            tracing::warn!("{advice}");
        }
        let status = Arc::new(NodeStatus::default());
        let pool = worker_pool(config.threads)?;
        let input = LiveInput::subscribe(&mut node, &config)?;
        let output = LiveOutput::advertise(&mut node, Arc::clone(&status))?;
        let (caller, listener) = match environment.echoes().then(|| echo(&mut node, &status)) {
            None => (None, None),
            Some(Ok((caller, listener))) => (Some(caller), Some(listener)),
            Some(Err(error)) => {
                // A keystore may not permit its topic.
                tracing::warn!("a stalled transport will not be noticed: {error}");
                (None, None)
            }
        };
        for topic in node.useless_qos_overrides() {
            tracing::warn!("qos_overrides for {topic} change nothing: the node has no such topic");
        }
        let regions_topic = output.regions_topic().to_owned();
        let graph = node.graph();
        let receive_buffer_bytes = node.receive_buffer_bytes();
        let topics = input.topics().to_vec();
        let store = Arc::new(ParameterStore::new(config));
        let resets = Arc::new(AtomicU64::new(0));
        let targets = Targets {
            store: Arc::clone(&store),
            clock: Arc::clone(&clock),
            resets: Arc::clone(&resets),
            echo: listener,
        };
        let services = Services::new(node, targets)?;
        tracing::info!(
            "{} on domain {}{}{}: waiting for {}; regions on {regions_topic}, other topics only while subscribed to (lazy)",
            names.full_name(),
            environment.domain_id,
            match environment.middleware {
                Middleware::Dds(_) if environment.localhost => ", this machine only",
                Middleware::Dds(_) => "",
                #[cfg(feature = "zenoh")]
                Middleware::Zenoh(_) => ", over Zenoh",
            },
            if environment.security.is_some() { ", secured" } else { "" },
            topics.iter().map(|topic| topic.name.as_str()).collect::<Vec<_>>().join(", "),
        );

        let pairs = Arc::new(Mailbox::new(1));
        let results = Arc::new(Mailbox::new(results_waiting));
        let spares = Arc::new(Mutex::new(Vec::new()));
        let (ending, ended) = channel();
        let (stop_services, services_stopped) = oneshot::channel();
        let (stop_input, input_stopped) = oneshot::channel();
        let mut runtime = Self {
            status: Arc::clone(&status),
            store: Arc::clone(&store),
            names: names.clone(),
            clock: Arc::clone(&clock),
            graph: Some(graph.clone()),
            regions_topic,
            stop: vec![stop_input, stop_services],
            ended,
            running: 0,
            rosout,
        };
        // From here on an error drops `runtime`, which stops what runs already.
        runtime.spawn("services", &ending, move || services.run(services_stopped))?;
        {
            let (store, status, pairs) =
                (Arc::clone(&store), Arc::clone(&status), Arc::clone(&pairs));
            runtime.spawn("input", &ending, move || {
                input.run(&store, &pairs, &status, input_stopped);
            })?;
        }
        let grays = Arc::new(Mailbox::new(1));
        {
            let (status, grays) = (Arc::clone(&status), Arc::clone(&grays));
            runtime.spawn("alignment", &ending, move || align::run(&grays, &status))?;
        }
        let worker = work::Worker {
            store: Arc::clone(&store),
            status: Arc::clone(&status),
            resets,
            pairs,
            results: Arc::clone(&results),
            spares: Arc::clone(&spares),
            grays: align::Sampler::new(grays),
        };
        runtime.spawn("pipeline", &ending, move || pool.install(move || worker.run()))?;
        let publisher = work::OutputThread {
            output,
            echo: caller,
            observer,
            store,
            status,
            clock,
            graph,
            topics,
            receive_buffer_bytes,
            node: names.node().to_owned(),
            results,
            spares,
        };
        runtime.spawn("output", &ending, move || publisher.run())?;
        Ok(runtime)
    }

    fn spawn(
        &mut self,
        name: &'static str,
        ending: &Sender<&'static str>,
        body: impl FnOnce() + Send + 'static,
    ) -> Result<(), RuntimeError> {
        let ending = ending.clone();
        thread::Builder::new()
            .name(name.to_owned())
            .spawn(move || {
                // Sent also when the body panics.
                struct Farewell(Sender<&'static str>, &'static str);
                impl Drop for Farewell {
                    fn drop(&mut self) {
                        // The runtime may have stopped waiting.
                        let _ = self.0.send(self.1);
                    }
                }
                let _farewell = Farewell(ending, name);
                body();
            })
            .map_err(|source| RuntimeError::Thread { name, source })?;
        self.running += 1;
        Ok(())
    }

    /// Counters of the node.
    pub fn status(&self) -> &NodeStatus {
        &self.status
    }

    /// The parameters in force.
    pub fn parameters(&self) -> &ParameterStore {
        &self.store
    }

    /// The node's names.
    pub const fn names(&self) -> &Names {
        &self.names
    }

    /// The node's time: the system's, or that of `/clock`.
    pub fn time(&self) -> Stamp {
        self.clock.now()
    }

    /// Full name of the `regions` topic.
    pub fn regions_topic(&self) -> &str {
        &self.regions_topic
    }

    /// What discovery knows; `None` once stopped.
    pub const fn graph(&self) -> Option<&Graph> {
        self.graph.as_ref()
    }

    /// The name of a thread that has ended by itself, which only a fault does.
    pub fn failed_thread(&mut self) -> Option<&'static str> {
        let name = self.ended.try_recv().ok()?;
        self.running -= 1;
        Some(name)
    }

    /// Stops: no more input is taken, what was taken is processed and
    /// published, the node leaves the graph. Waits for at most five seconds;
    /// false when a thread had not ended by then.
    pub fn stop(&mut self) -> bool {
        if self.rosout {
            log::disconnect_rosout();
        }
        log::mute_transport(true);
        self.stop.clear();
        self.graph = None;
        self.wait_for_threads()
    }

    fn wait_for_threads(&mut self) -> bool {
        let deadline = Instant::now() + STOP_PATIENCE;
        while self.running > 0 {
            let left = deadline.saturating_duration_since(Instant::now());
            match self.ended.recv_timeout(left) {
                Ok(_) => self.running -= 1,
                Err(RecvTimeoutError::Timeout) => return false,
                Err(RecvTimeoutError::Disconnected) => self.running = 0,
            }
        }
        true
    }
}

impl Drop for NodeRuntime {
    fn drop(&mut self) {
        self.stop();
    }
}
