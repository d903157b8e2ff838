//! Which part of a query runs on the card, and which on the CPU? [`CudaQuery`]: field, elements and buffers stay on the card from frame to
//! frame, and what the card leaves open the CPU searches.

use sdf_core::AnyField;
use sdf_core::contact::{Contact, Feature, one_per_feature};
use sdf_core::placed::Rigid;
use sdf_gpu::{
    CardContacts, Elements as CardElements, GpuError, GpuField, GpuMesh, GpuQuery, LentRows, QueryOptions, Stages,
    Unsettled,
};

use super::origins::Origins;
use super::{Cuda, CudaError, CudaFaces, CudaPoints};
use crate::{ContactOptions, Contacts, Elements, Field, MeshView, Method, QueryError, contacts};

/// A mesh and a field on a card, for a query a frame.
#[derive(Debug)]
pub struct CudaQuery {
    query: GpuQuery,
    field: Field,
    /// Points as they were given, for the search on the CPU; `None` where the card alone has them.
    points: Option<Vec<[f64; 3]>>,
    elements: Owned,
    options: ContactOptions,
    origins: Origins,
}

/// Elements as the search on the CPU wants them.
#[derive(Debug)]
enum Owned {
    Faces(Vec<[u32; 3]>),
    /// Faces that the card alone has.
    Lent(LentRows),
    Edges(Vec<[u32; 2]>),
    Vertices,
}

impl CudaQuery {
    pub(super) fn of_mesh(
        field: &Field,
        cuda: &Cuda,
        points: CudaPoints,
        faces: CudaFaces,
        options: &ContactOptions,
    ) -> Result<Self, CudaError> {
        let elements = match (options.elements, faces) {
            (Elements::Faces, CudaFaces::Slice(faces)) => Owned::Faces(faces.to_vec()),
            (Elements::Faces, CudaFaces::Lent(faces)) => Owned::Lent(faces),
            (Elements::Edges, CudaFaces::Slice(faces)) => Owned::Edges(MeshView { points: &[], faces }.edges()),
            (Elements::Edges, CudaFaces::Lent(faces)) => {
                let faces = cuda.gpu.read_lent::<[u32; 3]>(&faces)?;
                Owned::Edges(MeshView { points: &[], faces: &faces }.edges())
            }
            (Elements::Vertices, _) => Owned::Vertices,
        };
        Self::new(field, cuda, points, elements, options)
    }

    pub(super) fn of_edges(
        field: &Field,
        cuda: &Cuda,
        points: CudaPoints,
        edges: Vec<[u32; 2]>,
        options: &ContactOptions,
    ) -> Result<Self, CudaError> {
        Self::new(field, cuda, points, Owned::Edges(edges), options)
    }

    fn new(
        field: &Field,
        cuda: &Cuda,
        points: CudaPoints,
        elements: Owned,
        options: &ContactOptions,
    ) -> Result<Self, CudaError> {
        let card_options = card_options(&elements, options)?;
        let origins = Origins::new(field.as_any(), options.pose.as_ref(), matches!(points, CudaPoints::Slice(_)));
        let on_card = GpuField::with_origin(&cuda.gpu, field.as_any(), origins.field_origin)?;
        let card_elements = match &elements {
            Owned::Faces(faces) => CardElements::Faces(faces),
            Owned::Lent(faces) => CardElements::LentFaces(*faces),
            Owned::Edges(edges) => CardElements::Edges(edges),
            Owned::Vertices => CardElements::Vertices,
        };
        let mesh = match points {
            CudaPoints::Slice(points) => GpuMesh::new(&cuda.gpu, &origins.round_all(points), card_elements)?,
            CudaPoints::Lent(points) => GpuMesh::of_lent(&cuda.gpu, points, card_elements)?,
        };
        let query = match card_options.unsettled {
            certified @ Unsettled::CertifyThenList { .. } => {
                let listed = QueryOptions { unsettled: Unsettled::List, ..card_options };
                let mut query = GpuQuery::new(&cuda.gpu, &on_card, mesh, &listed)?;
                match query.set_unsettled(certified) {
                    // The certified kernel takes much memory; without it there is the CPU.
                    Err(error) if error.is_out_of_memory() => {}
                    done => done?,
                }
                query
            }
            _ => GpuQuery::new(&cuda.gpu, &on_card, mesh, &card_options)?,
        };
        let mut new = Self { query, field: field.clone(), points: exact(points), elements, options: *options, origins };
        new.query.set_pose(origins.pose(options.pose).as_ref())?;
        Ok(new)
    }

    /// Replaces the points of the mesh.
    pub fn set_points(&mut self, points: CudaPoints) -> Result<(), CudaError> {
        let has_points = matches!(points, CudaPoints::Slice(_));
        let origins = self.origins.moved(self.options.pose.as_ref(), has_points);
        match points {
            CudaPoints::Slice(points) => self.query.set_points(&origins.round_all(points))?,
            CudaPoints::Lent(points) => self.query.lend_points(points)?,
        }
        self.query.set_pose(origins.pose(self.options.pose).as_ref())?;
        (self.points, self.origins) = (exact(points), origins);
        Ok(())
    }

    /// Moves the field. One that goes far takes the points with it: they are copied to the card anew.
    pub fn set_pose(&mut self, pose: Option<Rigid>) -> Result<(), CudaError> {
        let origins = self.origins.moved(pose.as_ref(), self.points.is_some());
        if let Some(points) = self.points.as_ref().filter(|_| origins != self.origins) {
            self.query.set_points(&origins.round_all(points))?;
        }
        self.query.set_pose(origins.pose(pose).as_ref())?;
        (self.options.pose, self.origins) = (pose, origins);
        Ok(())
    }

    /// The contacts of this frame, in the order of elements.
    pub fn contacts(&mut self) -> Result<Contacts, CudaError> {
        let found = match self.query.contacts() {
            // A launch of the certified kernel takes local memory for every thread that the card can hold.
            Err(error) if error.is_out_of_memory() && self.options.method == Method::Auto => {
                self.query.set_unsettled(Unsettled::List)?;
                self.query.contacts()?
            }
            found => found?,
        };
        let poses = [self.options.pose, self.origins.pose(self.options.pose)];
        let in_world =
            |contact| self.lowered(self.origins.in_world(widened(contact)), poses.each_ref().map(Option::as_ref));
        let mut all = Contacts {
            contacts: found.contacts.iter().map(in_world).collect(),
            element_count: self.query.element_count(),
            searched_count: found.searched_count as usize,
            possible_count: 0,
            undecided_count: 0,
            not_finite_count: found.skipped_count as usize,
        };
        if !found.unsettled.is_empty() {
            let second = self.search_again(&found.unsettled)?;
            all.undecided_count += second.undecided_count;
            all.not_finite_count += second.not_finite_count;
            all.contacts.extend(second.contacts);
            all.contacts.sort_by_key(|contact| contact.element);
        }
        if self.options.one_per_feature {
            let count = one_per_feature(&mut all.contacts);
            all.contacts.truncate(count);
        }
        Ok(all)
    }

    /// The contacts of this frame, left on the card in no particular order: the bits that the kernels found. Refused for one contact
    /// a feature, where an element is left to the CPU, and where the points of a slice are far from the origin: f32 has no room for positions there.
    pub fn contacts_on_card(&mut self) -> Result<CardContacts, CudaError> {
        if self.options.one_per_feature {
            return Err(CudaError::OnlyOnCpu("one contact for each feature"));
        }
        if self.origins.world_origin != [0.0; 3] {
            return Err(CudaError::FarFromOrigin);
        }
        self.query.contacts_on_card()?.ok_or(CudaError::LeftToCpu)
    }

    /// The contact with bounds that hold on the element as it was given: the card searched the one whose corners are rounded to f32,
    /// and φ of two points differs by at most slope bound · distance. Points that the card alone has are exact, but for the rounding
    /// into the frame of a field that has a pose, which is small beside what each bound allows for: 0.87 ε of the largest coordinate of
    /// 32 ε.
    fn lowered(&self, contact: Contact<f64>, poses: [Option<&Rigid>; 2]) -> Contact<f64> {
        let Some(points) = &self.points else { return contact };
        let corners = contact.vertices.iter().filter_map(|vertex| points.get(*vertex as usize));
        let moved = corners.map(|corner| self.origins.rounding_of(corner, poses)).fold(0.0, f64::max);
        let moved = moved * self.field.slope_bound();
        // Of a sum in f64, and of the numbers in it.
        let below = |bound: f64| (bound - moved) - (bound.abs() + moved) * (4.0 * f64::EPSILON);
        match moved > 0.0 {
            true => Contact {
                lower_bound: below(contact.lower_bound),
                shape_lower_bound: below(contact.shape_lower_bound),
                ..contact
            },
            false => contact,
        }
    }

    /// Contacts of these elements by the search on the CPU, which reads points and faces from the card where they are there alone.
    fn search_again(&mut self, ids: &[u32]) -> Result<Contacts, CudaError> {
        let options = ContactOptions { one_per_feature: false, ..self.options };
        let field: &AnyField = self.field.as_any();
        if let Owned::Lent(_) = self.elements {
            self.elements = Owned::Faces(self.query.read_elements()?.as_chunks().0.to_vec());
        }
        let read: Vec<[f64; 3]>;
        let points = match &self.points {
            Some(points) => points,
            None => {
                read = self.query.read_points()?.iter().map(|point| point.map(f64::from)).collect();
                &read
            }
        };
        let mut found = match &self.elements {
            Owned::Faces(faces) => {
                let faces: Vec<_> = ids.iter().map(|id| faces[*id as usize]).collect();
                contacts::find(field, MeshView { points, faces: &faces }, &options)?
            }
            Owned::Edges(edges) => {
                let edges: Vec<_> = ids.iter().map(|id| edges[*id as usize]).collect();
                contacts::find_edges(field, points, &edges, &options)?
            }
            // Each is one point, and settled.
            Owned::Vertices | Owned::Lent(_) => Contacts::default(),
        };
        for contact in &mut found.contacts {
            contact.element = ids[contact.element as usize];
            if let Feature::Face(face) = &mut contact.feature {
                *face = contact.element;
            }
        }
        Ok(found)
    }
}

/// How the card searches; an error where only the CPU can.
fn card_options(elements: &Owned, options: &ContactOptions) -> Result<QueryOptions, CudaError> {
    options.check()?;
    let refused = [
        ("all minima", options.all_minima),
        ("a complete search", options.complete),
        ("an exact search", options.exact),
        ("samples with the corners", matches!(options.method, Method::SamplingWithCorners(_))),
    ];
    if let Some((what, _)) = refused.into_iter().find(|(_, asked)| *asked) {
        return Err(CudaError::OnlyOnCpu(what));
    }
    let is_edges = matches!(elements, Owned::Edges(_));
    if options.method == Method::GoldenSection && !is_edges {
        return Err(QueryError::GoldenSectionNeedsEdges.into());
    }
    let (method, iterations, unsettled) = match options.method {
        // A point has one minimum, found by one evaluation.
        _ if matches!(elements, Owned::Vertices) => (sdf_gpu::Method::PointSampling, 1, Unsettled::Keep),
        Method::Auto => {
            let unsettled = Unsettled::CertifyThenList { evaluations: options.budget() };
            (sdf_gpu::Method::FrankWolfe, Method::FrankWolfe.default_budget(), unsettled)
        }
        // Its answers in f64 decide what those in f32 leave open, and count what stays undecided.
        Method::Certified => (sdf_gpu::Method::Certified, options.budget(), Unsettled::List),
        Method::FrankWolfe => (sdf_gpu::Method::FrankWolfe, options.budget(), Unsettled::Keep),
        Method::ProjectedGradient => (sdf_gpu::Method::ProjectedGradient, options.budget(), Unsettled::Keep),
        Method::Newton => (sdf_gpu::Method::Newton, options.budget(), Unsettled::Keep),
        Method::GoldenSection => (sdf_gpu::Method::GoldenSection, options.budget(), Unsettled::Keep),
        Method::Sampling(samples) | Method::SamplingWithCorners(samples) => {
            (sdf_gpu::Method::PointSampling, samples, Unsettled::Keep)
        }
    };
    if options.lean && unsettled != Unsettled::Keep {
        return Err(GpuError::Unsupported("lean contacts by auto or certified").into());
    }
    let (margin, tolerance) = (options.margin as f32, options.tolerance);
    let stages = if options.lean { Stages::Lean } else { Stages::Separate };
    Ok(QueryOptions { method, margin, iterations, tolerance, stages, unsettled })
}

/// The points as they were given; `None` where the card alone has them.
fn exact(points: CudaPoints) -> Option<Vec<[f64; 3]>> {
    match points {
        CudaPoints::Slice(points) => Some(points.to_vec()),
        CudaPoints::Lent(_) => None,
    }
}

/// The same contact in f64, whose weights sum to one there.
fn widened(contact: &Contact<f32>) -> Contact<f64> {
    let weights = contact.weights.map(f64::from);
    let sum: f64 = weights.iter().sum();
    Contact {
        kind: contact.kind,
        element: contact.element,
        vertices: contact.vertices,
        rank: contact.rank,
        feature: contact.feature,
        weights: weights.map(|weight| weight / sum),
        point: contact.point.map(f64::from),
        surface_point: contact.surface_point.map(f64::from),
        normal: contact.normal.map(f64::from),
        slope: contact.slope.into(),
        distance: contact.distance.into(),
        lower_bound: contact.lower_bound.into(),
        error_bound: contact.error_bound.into(),
        shape_lower_bound: contact.shape_lower_bound.into(),
        evaluations: contact.evaluations,
        status: contact.status,
    }
}
