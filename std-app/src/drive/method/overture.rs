//! The overture of an irradiance cache on all threads: it looks over the picture from coarse to fine, gathers where no
//! record reaches, and commits what was found in its order. First where diffuse surfaces are seen, then where rough ones
//! have their light from.

use crate::drive::RenderError;
use crate::drive::crew::Crew;
use halflight_core::bsdf::Features;
use halflight_core::cache::irradiance::{CellFlux, IrradianceCache, Record};
use halflight_core::memory::{Arena, Line};
use halflight_core::transport::cached::gather::{GatherPoint, Gathering};
use halflight_core::transport::cached::placement::{PIXELS, ProgressiveOrder, Via};
use halflight_core::transport::{CausticMerging, Counters, PathIntegrator};

/// It looks at every other pixel of every other row: what lies between is reached from there, or path traced.
const STRIDE: u32 = 2;

/// Pixels that are looked at before it is gathered where records are missing: tasks of [`PIXELS`].
const LOOKED_AT: usize = 16 * PIXELS;

/// Records shrink when later ones clamp them or know better, so the overture looks again: so many times, or until a sweep
/// adds less than one record in so many. What rough surfaces scatter is looked at in other directions each time.
const SWEEPS: u32 = 4;
const FEW: usize = 50;

/// The first records were gathered by paths alone, which no record ended. After the first sweep those that took more rays
/// than this for each path, over the median, are forgotten: what follows finds its light where records are.
const ALONE: f32 = 1.3;

/// Places that are gathered at before their records are committed: the fewest and the most, and a part of the records that
/// there are, so that the first ones soon serve others.
const GATHERED: [usize; 2] = [8, 32];
const GATHERED_PART: usize = 4;

/// Records that had no time for others beside them become wider, step by step, until they serve this share of
/// what the camera sees, and by so much at most.
const WIDER: f32 = 1.3;
const WIDEST: f32 = 6.0;
const NEARLY_ALL: f64 = 0.98;

/// A cache that is being filled.
pub(in crate::drive) struct Growing<'a> {
    pub(in crate::drive) cache: IrradianceCache<'a>,
    /// Which of independent ones: it looks at another sample of each pixel, and gathers with other rays.
    index: u32,
    /// What the overture looks for; `None`: nothing any more.
    sight: Option<Via>,
    /// How far it is in its order.
    next: u64,
    /// Sweeps in this sight that are done, and how many records there were before this one.
    sweeps: u32,
    before: usize,
    /// Places at which it has gathered.
    gathered: u32,
    /// Records of a file, or of wider ones of a study.
    loaded: usize,
    /// Rays for each path, of each of the records that came then.
    efforts: Vec<f32>,
    /// Of each record; [`GatherPoint::NONE`] for those of a file.
    places: Vec<GatherPoint>,
}

/// What came of gathering at a place.
#[derive(Clone, Default)]
struct Found {
    record: Option<Record>,
    /// Rays for each path.
    effort: f32,
}

impl<'a> Growing<'a> {
    /// Number 0 or 1.
    pub(in crate::drive) fn new(cache: IrradianceCache<'a>, index: u32) -> Self {
        Self {
            cache,
            index,
            sight: Some(Via::Specular),
            next: 0,
            sweeps: 0,
            before: 0,
            gathered: 0,
            loaded: 0,
            efforts: Vec::new(),
            places: Vec::new(),
        }
    }

    /// Takes over the records of a file, which were gathered at so many places.
    pub(in crate::drive) fn restore(&mut self, records: &[Record], gathered: u32) {
        self.cache.restore(records);
        self.loaded = self.cache.records().len();
        self.places.resize(self.loaded, GatherPoint::NONE);
        self.gathered = gathered;
    }

    /// What names the gathering at the next place but `after`.
    fn number(&self, after: usize) -> u32 {
        2 * (self.gathered + after as u32) + self.index
    }

    /// Places at which it has gathered.
    pub(in crate::drive) fn gathered(&self) -> u32 {
        self.gathered
    }

    /// Begins again beside the records that there are, their radii smaller by `share`.
    pub(in crate::drive) fn tighten(&mut self, share: f32) {
        self.cache.scale_radii(share);
        self.loaded = self.cache.records().len();
        self.efforts.clear();
        self.places.truncate(self.loaded);
        (self.sight, self.next, self.sweeps, self.before) = (Some(Via::Specular), 0, 0, self.loaded);
    }

    /// Leaves the cache as it is.
    pub(in crate::drive) fn finish(&mut self) {
        self.sight = None;
    }

    /// Whether nothing will be added.
    pub(in crate::drive) fn is_finished(&self) -> bool {
        self.sight.is_none() || self.cache.is_full()
    }

    /// Goes on after a sweep: with another one, or with what rough surfaces see, if there are any.
    fn sweep(&mut self, has_rough: bool) {
        (self.next, self.sweeps) = (0, self.sweeps + 1);
        let is_first = self.sight == Some(Via::Specular) && self.sweeps == 1;
        if is_first {
            self.forget_lonely();
        }
        let records = self.cache.records().len();
        let adds_few = (records - self.before.min(records)) * FEW < records;
        self.before = records;
        if !is_first && adds_few || self.sweeps == SWEEPS {
            let is_next = has_rough && self.sight == Some(Via::Specular);
            (self.sight, self.sweeps) = (is_next.then_some(Via::Glossy), 0);
        }
    }

    /// What it looks for, and by which sample of each pixel.
    fn look(&self) -> Option<(u32, Via)> {
        self.sight.map(|sight| match sight {
            Via::Specular => (self.index, sight),
            Via::Glossy => (self.index + 2 * self.sweeps, sight),
        })
    }

    /// Forgets the records that were gathered before there were others. By their rays, and not by what they found, so that
    /// no light is preferred.
    fn forget_lonely(&mut self) {
        let mut sorted = self.efforts.clone();
        sorted.sort_by(f32::total_cmp);
        let most = ALONE * sorted.get(sorted.len() / 2).copied().unwrap_or(f32::INFINITY);
        let efforts = core::iter::repeat_n(0.0, self.loaded).chain(self.efforts.drain(..));
        let records = self.cache.records().iter().zip(&self.places).zip(efforts);
        let kept =
            records.filter(|(_, effort)| *effort <= most).map(|((record, place), _)| (*record, *place));
        let (records, places): (Vec<Record>, _) = kept.unzip();
        self.cache.restore(&records);
        self.places = places;
    }

    /// Whether nothing is to be gathered at `place`: a record of fewer than so many pixels serves no other.
    fn is_served(&self, place: &GatherPoint, least_pixels: f32) -> bool {
        self.cache.is_full() || place.is_confined(least_pixels) || self.cache.covers(&place.asker())
    }
}

/// See the file.
pub(in crate::drive) struct Overture<'o, 'a, F> {
    pub(in crate::drive) tracer: &'o PathIntegrator<'a, F>,
    /// Photons of caustics that gather rays merge with.
    pub(in crate::drive) photons: Option<CausticMerging<'o>>,
    pub(in crate::drive) gathering: Gathering<'o>,
    /// Of fewer strata, for what rough surfaces see: a pixel has the mean of many records there.
    pub(in crate::drive) coarse: &'o CellFlux<'o>,
    pub(in crate::drive) size: [u32; 2],
}

impl<F: Features> Overture<'_, '_, F> {
    /// Fills the cache, or goes on with it. Whether it is done: not where the round is over.
    pub(in crate::drive) fn fill(
        &self,
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let [width, height] = self.size;
        let order = ProgressiveOrder::new(width, height, STRIDE);
        // Where depth is limited only what is seen asks for records.
        let has_rough = self.tracer.has_rough_surfaces() && !self.tracer.is_limited();
        while let Some(sight) = growing.look()
            && !growing.is_finished()
        {
            if growing.next >= order.len() {
                growing.sweep(has_rough);
                continue;
            }
            let is_missing = |place: &GatherPoint| !growing.is_served(place, self.gathering.least_pixels);
            let Some(mut missing) = self.look(&order, growing.next, sight, &is_missing, crew, scratch)?
            else {
                return Ok(false);
            };
            while !missing.is_empty() {
                missing.retain(|place| !growing.is_served(place, self.gathering.least_pixels));
                let [fewest, most] = GATHERED;
                let most = (growing.cache.records().len() / GATHERED_PART).clamp(fewest, most);
                let batch: Vec<GatherPoint> = missing.drain(..missing.len().min(most)).collect();
                if !self.gather(&batch, growing, crew, scratch)? {
                    return Ok(false);
                }
            }
            growing.next += LOOKED_AT as u64;
        }
        Ok(true)
    }

    /// What share of the diffuse points that the camera sees records serve, by a look at pixels that are evenly spread and the
    /// last of its order; `None` where the round is over, or it sees none.
    fn served(
        &self,
        growing: &Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<f64>, RenderError> {
        let [width, height] = self.size;
        let order = ProgressiveOrder::new(width, height, STRIDE);
        let first = order.len().saturating_sub(LOOKED_AT as u64);
        let sight = (growing.index, Via::Specular);
        let Some(places) = self.look(&order, first, sight, &|_| true, crew, scratch)? else {
            return Ok(None);
        };
        let served =
            places.iter().filter(|place| growing.is_served(place, self.gathering.least_pixels)).count();
        Ok((!places.is_empty()).then(|| served as f64 / places.len() as f64))
    }

    /// Makes records wider, all by the same factor, until they serve nearly all that the camera sees or are
    /// [`WIDEST`] times as wide: where there was no time to fill the cache, it is coarser everywhere rather
    /// than good in places. Its first records are spread evenly over the picture.
    pub(in crate::drive) fn widen(
        &self,
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<(), RenderError> {
        let mut factor = 1.0;
        while factor < WIDEST
            && !growing.cache.records().is_empty()
            && self.served(growing, crew, scratch)?.is_some_and(|served| served < NEARLY_ALL)
        {
            factor *= WIDER;
            let mut wide = vec![Record::default(); growing.cache.records().len()];
            let widen = |index: usize, _: &mut Arena, out: &mut [Record]| {
                let mut counters = Counters::default();
                let found = growing.cache.records().get(index).zip(growing.places.get(index));
                if let (Some(out), Some((record, place))) = (out.first_mut(), found) {
                    *out = match place.is_some() {
                        true => self.tracer.widened(record, place, WIDER, &mut counters),
                        false => *record,
                    };
                }
                Ok(counters)
            };
            if !crew.pass(&mut wide, 1, scratch, &widen)? {
                return Ok(());
            }
            wide.into_iter().enumerate().for_each(|(i, record)| growing.cache.replace(i, record));
            growing.cache.rebuild();
        }
        Ok(())
    }

    /// What pixels see from the `first` of the order on, as far as it is wanted; `None` where the round is over.
    fn look(
        &self,
        order: &ProgressiveOrder,
        first: u64,
        sight: (u32, Via),
        is_wanted: &(dyn Fn(&GatherPoint) -> bool + Sync),
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<Option<Vec<GatherPoint>>, RenderError> {
        let mut places = vec![GatherPoint::NONE; LOOKED_AT];
        let look = |task: usize, _: &mut Arena, out: &mut [GatherPoint]| {
            let mut counters = Counters::default();
            self.tracer.places(order, first + (task * PIXELS) as u64, sight, out, &mut counters);
            let leave_out = |out: &mut [GatherPoint]| {
                out.iter_mut().filter(|p| !is_wanted(p)).for_each(|p| *p = GatherPoint::NONE)
            };
            leave_out(out);
            self.tracer.look_up(out, &mut counters);
            leave_out(out);
            Ok(counters)
        };
        let is_done = crew.pass(&mut places, PIXELS, scratch, &look)?;
        places.retain(GatherPoint::is_some);
        Ok(is_done.then_some(places))
    }

    /// Gathers at all of `places`, then commits the records in their order; whether that is done: not where the round is
    /// over.
    fn gather(
        &self,
        places: &[GatherPoint],
        growing: &mut Growing,
        crew: &mut Crew,
        scratch: &mut [Vec<Line>],
    ) -> Result<bool, RenderError> {
        let gathering = match growing.sight {
            Some(Via::Glossy) => Gathering { flux: self.coarse, ..self.gathering },
            _ => self.gathering,
        };
        // What a gather ray meets may be lit by the cache already.
        let tracer = self.tracer.with_growing_cache(&growing.cache);
        let mut all = vec![Found::default(); places.len()];
        let gather = |task: usize, arena: &mut Arena, out: &mut [Found]| {
            let mut counters = Counters::default();
            if let (Some(found), Some(place)) = (out.first_mut(), places.get(task)) {
                let number = growing.number(task);
                found.record = match self.photons {
                    Some(photons) => {
                        let tracer = tracer.with_caustics(photons);
                        tracer.gather(place, number, &gathering, arena, &mut counters)?
                    }
                    None => tracer.gather(place, number, &gathering, arena, &mut counters)?,
                };
                found.effort = counters.rays as f32 / counters.paths.max(1) as f32;
            }
            Ok(counters)
        };
        if !crew.pass(&mut all, 1, scratch, &gather)? {
            return Ok(false);
        }
        growing.gathered += places.len() as u32;
        for (Found { record, effort }, place) in all.into_iter().zip(places) {
            if let Some(record) = record
                && growing.cache.insert(record)
            {
                growing.efforts.push(effort);
                growing.places.push(*place);
            }
        }
        Ok(true)
    }
}
