//! The server: on 127.0.0.1 alone, for whoever has the token that the printed address carries.

use super::guard::guard;
use super::routes;
use super::setup::Setup;
use super::shared::Shared;
use super::state::Lab;
use super::worker::work;
use anyhow::{Context, Result};
use axum::middleware::from_fn_with_state;
use std::net::{Ipv4Addr, TcpListener};
use std::sync::{Arc, mpsc};

/// A server that has its port and does not answer yet.
pub struct Server {
    shared: Arc<Shared>,
    listener: TcpListener,
}

impl Server {
    /// Takes a port (0: any that is free) and reads the steps that are there.
    ///
    /// # Errors
    /// A port that is taken; a step that cannot be read.
    pub fn new(setup: Setup, port: u16) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port))
            .with_context(|| format!("port {port} of 127.0.0.1: cannot be taken; name another with --port"))?;
        let port = listener.local_addr()?.port();
        let (jobs, queue) = mpsc::channel();
        let lab = Arc::new(Lab::new(setup, jobs)?);
        let token = format!("{:032x}{:032x}", rand::random::<u128>(), rand::random::<u128>());
        let worker = lab.clone();
        std::thread::Builder::new().name("steps".into()).spawn(move || work(&worker, &queue))?;
        Ok(Self { shared: Arc::new(Shared { lab, port, token }), listener })
    }

    /// The address of the page.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.shared.port, self.shared.token)
    }

    /// Answers until the program is ended.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn serve(self) -> Result<()> {
        let Self { shared, listener } = self;
        shared.lab.begin()?;
        let runtime = tokio::runtime::Builder::new_multi_thread().worker_threads(2).enable_all().build()?;
        runtime.block_on(async {
            listener.set_nonblocking(true)?;
            let listener = tokio::net::TcpListener::from_std(listener)?;
            let routes = routes::all().layer(from_fn_with_state(shared.clone(), guard)).with_state(shared);
            axum::serve(listener, routes).await?;
            Ok(())
        })
    }
}
