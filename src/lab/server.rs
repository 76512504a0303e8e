//! The server: on 127.0.0.1 alone, for whoever has the token that the printed address carries.

use super::guard::{Access, guard};
use super::planning::{self, Planning};
use super::routes;
use super::setup::Setup;
use super::state::Lab;
use super::worker::work;
use anyhow::{Context, Result};
use axum::Router;
use axum::middleware::from_fn_with_state;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::{Arc, mpsc};

/// A server that has its port and does not answer yet.
pub struct Server {
    access: Arc<Access>,
    listener: TcpListener,
    routes: Router,
    /// Has a first step to take.
    lab: Option<Arc<Lab>>,
}

impl Server {
    /// The laboratory of a block. Takes a port (0: any that is free) and reads the steps that are there.
    ///
    /// # Errors
    /// A port that is taken; a step that cannot be read.
    pub fn of_lab(setup: Setup, port: u16) -> Result<Self> {
        // The port first: a second laboratory takes no steps.
        let (listener, port) = listener(port)?;
        let (jobs, queue) = mpsc::channel();
        let lab = Arc::new(Lab::new(setup, jobs)?);
        let worker = lab.clone();
        std::thread::Builder::new().name("steps".into()).spawn(move || work(&worker, &queue))?;
        Ok(Self { access: access(port), listener, routes: routes::all(lab.clone()), lab: Some(lab) })
    }

    /// A plan on sliders.
    ///
    /// # Errors
    /// A port that is taken.
    pub fn of_plan(planning: Planning, port: u16) -> Result<Self> {
        let (listener, port) = listener(port)?;
        Ok(Self { access: access(port), listener, routes: planning::routes::all(Arc::new(planning)), lab: None })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.access.port, self.access.token)
    }

    /// Answers until the program is ended.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn serve(self) -> Result<()> {
        let Self { access, listener, routes, lab } = self;
        lab.map_or(Ok(()), |lab| lab.begin())?;
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        runtime.block_on(async {
            listener.set_nonblocking(true)?;
            let listener = tokio::net::TcpListener::from_std(listener)?;
            axum::serve(listener, routes.layer(from_fn_with_state(access, guard))).await?;
            Ok(())
        })
    }
}

fn listener(port: u16) -> Result<(TcpListener, u16)> {
    let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
        .with_context(|| format!("port {port} of 127.0.0.1: cannot be taken; name another with --port"))?;
    let port = listener.local_addr()?.port();
    Ok((listener, port))
}

fn access(port: u16) -> Arc<Access> {
    Arc::new(Access { port, token: format!("{:032x}{:032x}", rand::random::<u128>(), rand::random::<u128>()) })
}
