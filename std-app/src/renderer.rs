//! Renderer of a loaded scene: one build for many views.

use crate::bake::{BakeProgress, BakeSettings, Baked, Sensor};
use crate::error::Error;
use crate::load::{self, LoadOptions, LoadedScene, SceneViews, View};
use crate::render::{
    Built, BuiltMemory, Pool, Progress, RenderError, RenderResult, Request, Settings, with_points,
};
use core::sync::atomic::AtomicBool;
use halflight_core::bvh::Coherence;
use halflight_core::geometry::{Hit, Ray};
pub use halflight_core::scene::Camera;
use halflight_core::{IrradiancePoint, Level};
use rayon::prelude::*;
use std::collections::HashMap;
use std::path::Path;
use std::sync::{Arc, Mutex, PoisonError};

/// Rays that a thread traces together.
const RAYS: usize = 4096;

/// A loaded scene with its hierarchy, its lights and its threads. Renders of several views share them, also
/// at the same time from several threads.
///
/// ```no_run
/// use halflight::Renderer;
/// use halflight::render::{Settings, Stop};
///
/// let renderer = Renderer::open("scenes/cornell/cornell.obj")?;
/// let stop = Stop { error: Some(1e-3), ..Stop::default() };
/// let picture = renderer.render(&Settings { stop, ..Settings::default() })?;
/// halflight::save::write("cornell.png".as_ref(), &picture.image)?;
/// # Ok::<(), halflight::Error>(())
/// ```
pub struct Renderer {
    scene: BuiltScene,
    /// Pools by their number of threads.
    pools: Mutex<HashMap<Option<usize>, Arc<Pool>>>,
}

/// Owner of what [`View`]s borrow.
struct Owner {
    loaded: LoadedScene,
    memory: BuiltMemory,
}

/// Structures and texture views of an owned scene.
struct OfScene<'a> {
    views: SceneViews<'a>,
    built: Built<'a>,
}

self_cell::self_cell!(
    struct BuiltScene {
        owner: Owner,
        #[covariant]
        dependent: OfScene,
    }
);

impl Renderer {
    /// Loads `path`, a scene file or a mesh, and builds its structures.
    ///
    /// # Errors
    /// Those of [`load::load`] and [`Renderer::new`].
    pub fn open(path: impl AsRef<Path>) -> Result<Self, Error> {
        Self::new(load::load(path.as_ref(), &LoadOptions::default())?, None)
    }

    /// Builds the structures of `loaded` within `memory` bytes; `None`: no limit.
    ///
    /// # Errors
    /// Insufficient memory, or no threads.
    pub fn new(loaded: LoadedScene, memory: Option<usize>) -> Result<Self, Error> {
        let pool = Arc::new(Pool::start(None)?);
        let owner = Owner { loaded, memory: BuiltMemory::default() };
        let scene = BuiltScene::try_new(owner, |owner| {
            let views = owner.loaded.views();
            let scene = views.scene(owner.loaded.camera_or_default());
            let built = Built::new(&scene, (Level::detect(), memory), &pool, &owner.memory)?;
            Ok::<_, RenderError>(OfScene { views, built })
        })?;
        Ok(Self { scene, pools: Mutex::new(HashMap::from([(None, pool)])) })
    }

    /// The loaded scene, with its notes.
    pub fn scene(&self) -> &LoadedScene {
        &self.scene.borrow_owner().loaded
    }

    /// Seconds of building.
    pub fn build_seconds(&self) -> f64 {
        self.scene.borrow_dependent().built.seconds()
    }

    /// A pinhole camera at `view`, in the coordinates of the files; `None` if both of its points are equal.
    pub fn camera(&self, view: View, fov_degrees: f64) -> Option<Camera> {
        let camera = self.scene().camera_at(view, fov_degrees)?;
        Some(self.scene().with_start(camera, view))
    }

    /// Renders the view of the scene file, or one that frames the scene.
    ///
    /// # Errors
    /// Those of [`crate::render::render`].
    pub fn render(&self, settings: &Settings) -> Result<RenderResult, Error> {
        self.render_view(self.scene().camera_or_default(), settings)
    }

    /// Renders the view of `camera`, mostly one of [`Renderer::camera`].
    ///
    /// # Errors
    /// Those of [`crate::render::render`].
    pub fn render_view(&self, camera: Camera, settings: &Settings) -> Result<RenderResult, Error> {
        self.render_with(camera, settings, &mut |_| {}, &AtomicBool::new(false))
    }

    /// Renders the view of `camera` until a rule of `settings.stop` holds or `interrupt` is raised, from any
    /// thread. The calling thread calls `progress` after each round, outside the measured time.
    ///
    /// # Errors
    /// Those of [`crate::render::render`].
    pub fn render_with(
        &self,
        camera: Camera,
        settings: &Settings,
        progress: &mut dyn FnMut(&Progress),
        interrupt: &AtomicBool,
    ) -> Result<RenderResult, Error> {
        let OfScene { views, built } = self.scene.borrow_dependent();
        let scene = views.scene(camera);
        let pool = self.pool(settings.threads)?;
        Ok(Request::open(&scene, settings)?.render(built, &pool, progress, interrupt)?)
    }

    /// Irradiance of `sensors`, which have the coordinates of the files, with intervals.
    ///
    /// # Errors
    /// Those of [`crate::bake::irradiance`].
    pub fn irradiance_at(&self, sensors: &[Sensor], settings: &BakeSettings) -> Result<Baked, Error> {
        let points: Vec<_> = sensors.iter().map(|sensor| sensor.point(self.scene())).collect();
        self.irradiance(&points, settings)
    }

    /// Irradiance of `points`, with intervals. The points have the coordinates of the core, in which the
    /// scene is centred and scaled: [`crate::bake::vertices`] and [`Sensor::point`] give them.
    ///
    /// # Errors
    /// Those of [`crate::bake::irradiance`].
    pub fn irradiance(&self, points: &[IrradiancePoint], settings: &BakeSettings) -> Result<Baked, Error> {
        self.irradiance_with(points, settings, &mut |_| {}, &AtomicBool::new(false))
    }

    /// As [`Renderer::irradiance`], until a rule of `settings.stop` holds or `interrupt` is raised. The
    /// calling thread calls `progress` after each round.
    ///
    /// # Errors
    /// Those of [`crate::bake::irradiance`].
    pub fn irradiance_with(
        &self,
        points: &[IrradiancePoint],
        settings: &BakeSettings,
        progress: &mut dyn FnMut(&BakeProgress),
        interrupt: &AtomicBool,
    ) -> Result<Baked, Error> {
        let OfScene { views, built } = self.scene.borrow_dependent();
        let scene = views.scene(self.scene().camera_or_default());
        let pool = self.pool(settings.threads)?;
        Ok(with_points((&scene, built), (points, settings), &pool, progress, interrupt)?)
    }

    /// The nearest hits of rays in the coordinates of the core ([`LoadedScene::transform`]), on all threads;
    /// triangles are those of [`LoadedScene::triangles`].
    ///
    /// # Errors
    /// No threads.
    pub fn nearest(&self, rays: &[Ray]) -> Result<Vec<Hit>, Error> {
        let bvh = self.scene.borrow_dependent().built.bvh();
        let mut hits = vec![Hit::NONE; rays.len()];
        let trace = |(rays, hits): (&[Ray], &mut [Hit])| {
            bvh.nearest_batch(Level::detect(), rays, Coherence::Incoherent, hits);
        };
        self.pool(None)?.install(|| rays.par_chunks(RAYS).zip(hits.par_chunks_mut(RAYS)).for_each(trace));
        Ok(hits)
    }

    /// For each ray 1 if it hits anything, else 0; coordinates as of [`Renderer::nearest`].
    ///
    /// # Errors
    /// No threads.
    pub fn occluded(&self, rays: &[Ray]) -> Result<Vec<u8>, Error> {
        let bvh = self.scene.borrow_dependent().built.bvh();
        let mut hidden = vec![0; rays.len()];
        let trace = |(rays, hidden): (&[Ray], &mut [u8])| bvh.occluded_batch(Level::detect(), rays, hidden);
        self.pool(None)?.install(|| rays.par_chunks(RAYS).zip(hidden.par_chunks_mut(RAYS)).for_each(trace));
        Ok(hidden)
    }

    /// The pool of so many threads.
    fn pool(&self, threads: Option<usize>) -> Result<Arc<Pool>, RenderError> {
        let mut pools = self.pools.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(pool) = pools.get(&threads) {
            return Ok(pool.clone());
        }
        let pool = Arc::new(Pool::start(threads)?);
        pools.insert(threads, pool.clone());
        Ok(pool)
    }
}
