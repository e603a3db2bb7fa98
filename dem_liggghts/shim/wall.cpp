// The coupling's wall inside LIGGGHTS: a fix "wall/gran/nodal" derived from LIGGGHTS' own FixWallGran, and the few calls
// by which Python drives one LIGGGHTS instance. Contact models, time integration, neighbour lists and migration between
// ranks are LIGGGHTS' own. Ours are the elements (segments in the plane z = 0, triangles in space) whose nodes move
// linearly within a window, the contact search, and the forces on the nodes.
//
// The nodes are the same on every rank, so a LIGGGHTS mesh (distributed, rebuilt when it moves, coplanarity fixed when
// read) would only cost: the fix is one of LIGGGHTS' "primitive" walls whose search is replaced. The primitive named in
// the command is never used.
//
// All arrays are contiguous doubles in SI units. Calls return 0, or 1 with the text in dem_last_error(), or 2 when a
// particle or a node is NaN or infinite.
#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "atom.h"
#include "atom_vec.h"
#include "comm.h"
#include "domain.h"
#include "error.h"
#include "fix_property_atom.h"
#include "fix_wall_gran.h"
#include "input.h"
#include "integrate.h"
#include "lammps.h"
#include "library.h"
#include "modify.h"
#include "neighbor.h"
#include "output.h"
#include "update.h"

using namespace LAMMPS_NS;

// ---- LIGGGHTS errors become exceptions -------------------------------------------------------------------------------
// Same mangled names as in the library, which is loaded after this file: the first definition wins, and an error no
// longer ends the process.
static std::string last_error;

struct NotFinite {};

[[noreturn]] static void raise_error(const char *file, int line, const std::string &text)
{
    const char *name = std::strrchr(file, '/');
    throw std::runtime_error(text + " (" + (name ? name + 1 : file) + ":" + std::to_string(line) + ")");
}

namespace LAMMPS_NS {
void Error::all(const char *file, int line, const char *text) { raise_error(file, line, text); }
void Error::one(const char *file, int line, const char *text)
{
    int ranks;
    MPI_Comm_size(world, &ranks);
    if (ranks > 1) {  // the other ranks know nothing of it and would wait for ever
        std::fprintf(stderr, "LIGGGHTS error on one rank: %s (%s:%d)\n", text, file, line);
        MPI_Abort(world, 1);
    }
    raise_error(file, line, text);
}
void Error::universe_all(const char *file, int line, const char *text) { raise_error(file, line, text); }
void Error::universe_one(const char *file, int line, const char *text) { Error::one(file, line, text); }
void Error::fix_error(const char *file, int line, Fix *fix, const char *style, const char *text)
{
    raise_error(file, line, std::string("fix ") + fix->id + " (" + style + "): " + text);
}
void Error::fix_error(const char *file, int line, Fix *fix, const char *text)
{
    fix_error(file, line, fix, fix->style, text);
}
}  // namespace LAMMPS_NS

// Modify's table of fix styles is private; an explicit instantiation may name it (plain C++, no #define private public).
using FixStyles = std::map<std::string, Fix *(*)(LAMMPS *, int, char **)>;
template <FixStyles *Modify::*member> struct StyleTable {
    friend FixStyles &fix_styles(Modify *modify) { return *(modify->*member); }
};
FixStyles &fix_styles(Modify *modify);
template struct StyleTable<&Modify::fix_map>;

// ---- contact geometry ------------------------------------------------------------------------------------------------
static double dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

// Contact point of a sphere on one element. feature: 0 inside the element, 1 edge of a triangle, 2 vertex.
struct Contact {
    int element, feature;
    double distance, offset[3], weight[3];  // offset: from the sphere's centre to the contact point
};

static int nearest_on_segment(const double (*node)[3], const double *p, double *w)
{
    double ab[3], ap[3];
    for (int k = 0; k < 3; k++) {
        ab[k] = node[1][k] - node[0][k];
        ap[k] = p[k] - node[0][k];
    }
    const double s = dot(ab, ap) / dot(ab, ab);
    w[1] = std::min(std::max(s, 0.0), 1.0);
    w[0] = 1.0 - w[1];
    w[2] = 0.0;
    return s <= 0.0 || s >= 1.0 ? 2 : 0;
}

// Ericson, Real-Time Collision Detection (2005), section 5.1.5
static int nearest_on_triangle(const double (*node)[3], const double *p, double *w)
{
    double ab[3], ac[3], ap[3], bp[3], cp[3];
    for (int k = 0; k < 3; k++) {
        ab[k] = node[1][k] - node[0][k];
        ac[k] = node[2][k] - node[0][k];
        ap[k] = p[k] - node[0][k];
        bp[k] = p[k] - node[1][k];
        cp[k] = p[k] - node[2][k];
    }
    auto result = [w](double w0, double w1, double w2, int feature) {
        w[0] = w0, w[1] = w1, w[2] = w2;
        return feature;
    };
    const double d1 = dot(ab, ap), d2 = dot(ac, ap), d3 = dot(ab, bp), d4 = dot(ac, bp), d5 = dot(ab, cp), d6 = dot(ac, cp);
    if (d1 <= 0 && d2 <= 0) return result(1, 0, 0, 2);
    if (d3 >= 0 && d4 <= d3) return result(0, 1, 0, 2);
    if (d6 >= 0 && d5 <= d6) return result(0, 0, 1, 2);
    const double va = d3 * d6 - d5 * d4, vb = d5 * d2 - d1 * d6, vc = d1 * d4 - d3 * d2;
    if (vc <= 0 && d1 >= 0 && d3 <= 0) return result(1 - d1 / (d1 - d3), d1 / (d1 - d3), 0, 1);
    if (vb <= 0 && d2 >= 0 && d6 <= 0) return result(1 - d2 / (d2 - d6), 0, d2 / (d2 - d6), 1);
    if (va <= 0 && d4 >= d3 && d5 >= d6) {
        const double s = (d4 - d3) / ((d4 - d3) + (d5 - d6));
        return result(0, 1 - s, s, 1);
    }
    const double s = 1 / (va + vb + vc);
    return result(1 - vb * s - vc * s, vb * s, vc * s, 0);
}

static bool before(const Contact &a, const Contact &b, double radius)
{
    if (std::fabs(a.distance - b.distance) < 1e-12 * radius && a.feature != b.feature) return a.feature < b.feature;
    return a.distance != b.distance ? a.distance < b.distance : a.element < b.element;
}

// Double hierarchy (Santasusana et al., Comput. Part. Mech. 3 (2016) 407-428), the same rules as in wall.py: keep the
// nearest, drop every other whose point lies on or beyond its tangent plane (a neighbour seen at a shared edge) or whose
// normal differs by less than one degree (a gently bent surface), go on with the rest. Real valleys keep two.
static void keep_distinct(std::vector<Contact> &contacts, double radius)
{
    static const double coplanar = std::cos(M_PI / 180.0);
    for (auto nearest = contacts.begin(); nearest != contacts.end(); ++nearest) {
        auto best = nearest;
        for (auto c = nearest + 1; c != contacts.end(); ++c)
            if (before(*c, *best, radius)) best = c;
        std::swap(*nearest, *best);
        const Contact &g = *nearest;
        auto redundant = [&g](const Contact &c) {
            const double cosine = dot(c.offset, g.offset);
            return cosine >= g.distance * g.distance * (1 - 1e-9) || cosine >= c.distance * g.distance * coplanar;
        };
        contacts.erase(std::remove_if(nearest + 1, contacts.end(), redundant), contacts.end());
    }
}

// ---- the fix -----------------------------------------------------------------------------------------------------------
class FixWallNodal : public FixWallGran {
public:
    FixWallNodal(LAMMPS *lmp, int argc, char **argv) : FixWallGran(lmp, argc, argv) {}
    static Fix *create(LAMMPS *lmp, int argc, char **argv) { return new FixWallNodal(lmp, argc, argv); }

    // Per particle, SLOTS tangential springs: [element + 1, or 0 when free; history values], in the order of its contacts. A fix property/atom
    // holds them, so that they migrate with their particle.
    void post_create() override
    {
        if (!dnum_) return;
        if (dnum_ > MAX_HISTORY) throw std::runtime_error("the wall's contact model keeps more history than the wall can");
        std::vector<std::string> words = {"wall_history", "all", "property/atom", "wall_history", "vector", "no", "no", "no"};
        words.resize(8 + SLOTS * (1 + dnum_), "0.");
        std::vector<char *> argv;
        for (std::string &word : words) argv.push_back(&word[0]);
        modify->add_fix(int(argv.size()), argv.data());
        history_ = static_cast<FixPropertyAtom *>(modify->find_fix_id("wall_history"));
    }

    int setmask() override
    {
        return FixConst::INITIAL_INTEGRATE | FixConst::PRE_EXCHANGE | FixConst::PRE_NEIGHBOR | FixConst::POST_FORCE;
    }

    void set_elements(int dim, int nodes, int elements, const int *element)
    {
        dim_ = dim;
        element_.assign(element, element + dim * elements);
        v_.assign(dim * nodes, 0.0);
        x_last_listed_ = x_node_ = impulse_ = v_;
    }

    // Nodes move along x + v t, from now on, for a window of the given length.
    void start_window(const double *x, const double *v, double length)
    {
        std::copy(x, x + x_node_.size(), x_node_.begin());
        std::copy(v, v + v_.size(), v_.begin());
        std::fill(impulse_.begin(), impulse_.end(), 0.0);
        step_ = 0;
        length_ = length;
        double sum = 0.0;
        for (size_t i = 0; i < v_.size(); i++) sum += x_node_[i] + v_[i];
        if (!std::isfinite(sum)) throw NotFinite();
        const double allowed = 0.5 * neighbor->skin;
        for (size_t i = 0; i < v_.size() && !stale_; i++) {  // per component, as the boxes of the lists
            const double start = x_node_[i] - x_last_listed_[i];
            stale_ = std::max(std::fabs(start), std::fabs(start + v_[i] * length)) > allowed;
        }
    }

    bool finite_particles() const
    {
        double sum = 0.0;
        for (int i = 0; i < atom->nlocal; i++) sum += atom->x[i][0] + atom->x[i][1] + atom->x[i][2];
        return std::isfinite(sum);
    }

    void initial_integrate(int) override { step_++; }
    void pre_neighbor() override { stale_ = true; }  // particles are renumbered when LIGGGHTS rebuilds its lists

    // A NaN would be turned into the index of a bin.
    void pre_exchange() override
    {
        int bad = !finite_particles(), any;
        MPI_Allreduce(&bad, &any, 1, MPI_INT, MPI_MAX, world);
        if (any) throw NotFinite();
    }

    // The force on the nodes is carried over to the next step, whose first half kick it gives.
    std::vector<double> carried_force() const
    {
        std::vector<double> dense(v_.size(), 0.0);
        for (const NodalForce &force : force_)
            for (int k = 0; k < dim_; k++) dense[force.first + k] += force.f[k];
        return dense;
    }

    void set_carried_force(const double *dense)
    {
        force_.clear();
        for (int first = 0; first < int(v_.size()); first += dim_) {
            NodalForce force = {first, {0, 0, 0}};
            std::copy(dense + first, dense + first + dim_, force.f);
            force_.push_back(force);
        }
    }

    std::vector<double> positions() const  // of the nodes, now
    {
        std::vector<double> x(x_node_);
        for (size_t i = 0; i < x.size(); i++) x[i] += v_[i] * (step_ * update->dt);
        return x;
    }

    const std::vector<double> &impulse() const { return impulse_; }

private:
    static const int SLOTS = 8, MAX_HISTORY = 16;

    struct NodalForce {
        int first;  // component of the node in the flat arrays
        double f[3];
    };
    struct Pair {
        int particle, element;
    };

    int dim_ = 3, step_ = 0;
    double length_ = 0.0;
    bool stale_ = true;
    std::vector<int> element_;
    std::vector<double> x_node_, v_, x_last_listed_, impulse_;
    std::vector<NodalForce> force_;
    std::vector<Pair> pairs_;
    std::vector<Contact> contacts_;
    FixPropertyAtom *history_ = nullptr;

    void nodes_at(int element, double t, double (*out)[3]) const
    {
        for (int j = 0; j < dim_; j++) {
            const int node = dim_ * element_[dim_ * element + j];
            out[j][2] = 0.0;
            for (int k = 0; k < dim_; k++) out[j][k] = x_node_[node + k] + v_[node + k] * t;
        }
    }

    // Pairs of particle and element that may meet before the lists are made anew: boxes around the path of each element
    // in the rest of the window, searched along the wall's longest axis.
    void list_pairs(double t)
    {
        struct Box {
            double lo[3], hi[3];
            int element;
        };
        const int elements = int(element_.size()) / dim_;
        std::vector<Box> boxes(elements);
        double lo[3], hi[3], node[3][3];
        for (int k = 0; k < 3; k++) lo[k] = HUGE_VAL, hi[k] = -HUGE_VAL;
        for (int e = 0; e < elements; e++) {
            Box &box = boxes[e];
            box.element = e;
            for (int k = 0; k < 3; k++) box.lo[k] = HUGE_VAL, box.hi[k] = -HUGE_VAL;
            for (double when : {t, length_}) {
                nodes_at(e, when, node);
                for (int j = 0; j < dim_; j++)
                    for (int k = 0; k < 3; k++) {
                        box.lo[k] = std::min(box.lo[k], node[j][k]);
                        box.hi[k] = std::max(box.hi[k], node[j][k]);
                    }
            }
            for (int k = 0; k < 3; k++) lo[k] = std::min(lo[k], box.lo[k]), hi[k] = std::max(hi[k], box.hi[k]);
        }
        int axis = 0;
        for (int k = 1; k < 3; k++)
            if (hi[k] - lo[k] > hi[axis] - lo[axis]) axis = k;
        std::sort(boxes.begin(), boxes.end(), [axis](const Box &a, const Box &b) {
            return a.lo[axis] != b.lo[axis] ? a.lo[axis] < b.lo[axis] : a.element < b.element;
        });
        double widest = 0.0;
        for (const Box &box : boxes) widest = std::max(widest, box.hi[axis] - box.lo[axis]);

        pairs_.clear();
        for (int i = 0; i < atom->nlocal; i++) {
            const double *x = atom->x[i], reach = atom->radius[i] + neighbor->skin;
            auto box = std::lower_bound(boxes.begin(), boxes.end(), x[axis] - reach - widest,
                                        [axis](const Box &b, double value) { return b.lo[axis] < value; });
            for (; box != boxes.end() && box->lo[axis] <= x[axis] + reach; ++box) {
                bool near = true;
                for (int k = 0; k < 3; k++) near = near && box->lo[k] - reach <= x[k] && x[k] <= box->hi[k] + reach;
                if (near) pairs_.push_back({i, box->element});
            }
        }
        for (size_t i = 0; i < v_.size(); i++) x_last_listed_[i] = x_node_[i] + v_[i] * length_;
        stale_ = false;
    }

    void post_force_primitive(int) override
    {
        const double t = step_ * update->dt;
        if (stale_) list_pairs(t);
        const double half = update->setupflag ? 0.0 : 0.5 * update->dt;
        if (half) add_impulse(half);
        force_.clear();
        for (size_t first = 0, last; first < pairs_.size(); first = last) {
            const int i = pairs_[first].particle;
            for (last = first; last < pairs_.size() && pairs_[last].particle == i; last++) {}
            collect_contacts(i, &pairs_[first], &pairs_[0] + last, t);
            if (history_) update_springs(i);
            for (size_t c = 0; c < contacts_.size(); c++) apply(i, contacts_[c], c);
        }
        if (half) add_impulse(half);
    }

    void add_impulse(double half_step)
    {
        for (const NodalForce &force : force_)
            for (int k = 0; k < dim_; k++) impulse_[force.first + k] += half_step * force.f[k];
    }

    void collect_contacts(int i, const Pair *pair, const Pair *end, double t)
    {
        contacts_.clear();
        double node[3][3];
        const double *x = atom->x[i], radius = atom->radius[i];
        for (; pair != end; ++pair) {
            Contact c;
            c.element = pair->element;
            nodes_at(c.element, t, node);
            c.feature = dim_ == 2 ? nearest_on_segment(node, x, c.weight) : nearest_on_triangle(node, x, c.weight);
            for (int k = 0; k < 3; k++) {
                c.offset[k] = -x[k];
                for (int j = 0; j < dim_; j++) c.offset[k] += c.weight[j] * node[j][k];
            }
            c.distance = std::sqrt(dot(c.offset, c.offset));
            if (c.distance <= radius) contacts_.push_back(c);
        }
        if (contacts_.size() > 1) keep_distinct(contacts_, radius);
    }

    bool share_node(int a, int b) const
    {
        const int *na = &element_[dim_ * a], *nb = &element_[dim_ * b];
        return std::find_first_of(na, na + dim_, nb, nb + dim_) != na + dim_;
    }

    // One spring per contact. A new contact takes the spring of one that has just ended on an element with a common node:
    // the sphere went across the border (LIGGGHTS turns the spring into the new tangent plane).
    void update_springs(int i)
    {
        double old[SLOTS][1 + MAX_HISTORY], *slots = history_->array_atom[i];
        const int width = 1 + dnum_;
        if (contacts_.size() > size_t(SLOTS)) throw std::runtime_error("a particle touches the wall at more than 8 places");
        for (int s = 0; s < SLOTS; s++) std::copy_n(slots + s * width, width, old[s]);
        std::fill_n(slots, SLOTS * width, 0.0);
        for (const Contact &c : contacts_) {
            double *slot = slots + width * (&c - contacts_.data());
            const double *from = nullptr;
            for (const auto &o : old) {
                const int element = int(o[0]) - 1;
                if (element == c.element) {
                    from = o;
                    break;
                }
                if (element >= 0 && !touched(element) && share_node(element, c.element)) from = o;
            }
            if (from) std::copy_n(from, width, slot);
            slot[0] = c.element + 1;
        }
    }

    bool touched(int element) const
    {
        return std::any_of(contacts_.begin(), contacts_.end(), [element](const Contact &c) { return c.element == element; });
    }

    // The library's own contact model; what it adds to the particle's force goes to the nodes with the opposite sign.
    void apply(int i, const Contact &c, size_t slot)
    {
        LCM::SurfacesIntersectData data;
        data.is_wall = true;
        data.i = i;
        data.radi = atom->radius[i];
        data.deltan = data.radi - c.distance;
        data.contact_history = history_ ? history_->array_atom[i] + slot * (1 + dnum_) + 1 : nullptr;
        double wall_velocity[3] = {0, 0, 0};
        for (int j = 0; j < dim_; j++)
            for (int k = 0; k < dim_; k++)
                wall_velocity[k] += c.weight[j] * v_[dim_ * element_[dim_ * c.element + j] + k];
        double *f = atom->f[i];
        const double before[3] = {f[0], f[1], f[2]};
        for (int k = 0; k < 3; k++) data.delta[k] = -c.offset[k], f[k] = 0.0;
        impl->compute_force(this, data, true, wall_velocity);
        for (int j = 0; j < dim_; j++) {
            NodalForce force = {dim_ * element_[dim_ * c.element + j], {0, 0, 0}};
            for (int k = 0; k < dim_; k++) force.f[k] = -c.weight[j] * f[k];
            force_.push_back(force);
        }
        for (int k = 0; k < 3; k++) f[k] += before[k];
    }
};

// ---- calls from Python -----------------------------------------------------------------------------------------------
static FixWallNodal *wall_of(LAMMPS *lmp)
{
    FixWallNodal *wall = dynamic_cast<FixWallNodal *>(lmp->modify->find_fix_id("wall"));
    if (!wall) throw std::runtime_error("there is no fix \"wall\" of style wall/gran/nodal");
    return wall;
}

template <class Work> static int guarded(Work work)
{
    try {
        work();
        return 0;
    } catch (const std::exception &e) {
        last_error = e.what();
        return 1;
    } catch (const NotFinite &) {
        return 2;
    }
}

static void run_steps(LAMMPS *lmp, int steps)  // "run N pre no post no" without its parsing and output
{
    Update *update = lmp->update;
    update->whichflag = 1;
    update->nsteps = steps;
    update->beginstep = update->firststep = update->ntimestep;
    update->endstep = update->laststep = update->ntimestep + steps;
    lmp->output->next = update->laststep + 1;
    update->integrate->run(steps);
    update->whichflag = 0;
}

static void forget_particles(Atom *atom) { atom->nlocal = atom->nghost = 0; }

// A record of the state: [length, tag, force (3), torque (3), what LIGGGHTS sends when the particle changes its rank].
static const int HEAD = 8;

// Records may come in any order of ranks; afterwards every rank holds its own particles in the order of the records.
static void unpack_particles(LAMMPS *lmp, int count, double *records)
{
    Atom *atom = lmp->atom;
    forget_particles(atom);
    for (double *r = records; r != records + count; r += int(r[0])) atom->avec->unpack_exchange(r + HEAD);
    lmp->domain->pbc();
    lmp->domain->reset_box();
    forget_particles(atom);
    for (double *r = records; r != records + count; r += int(r[0]))
        if (lmp->domain->is_in_subdomain(r + HEAD + 1)) atom->avec->unpack_exchange(r + HEAD);
    lmp->update->integrate->setup_minimal(1);
    int mine = 0;
    for (double *r = records; r != records + count; r += int(r[0])) {
        if (mine == atom->nlocal || atom->tag[mine] != int(r[1])) continue;
        std::copy(r + 2, r + 5, atom->f[mine]);
        std::copy(r + 5, r + HEAD, atom->torque[mine]);
        mine++;
    }
    if (mine != atom->nlocal) throw std::runtime_error("the state is not one of these particles");
}

extern "C" {
const char *dem_last_error() { return last_error.c_str(); }

int dem_open(int argc, char **argv, MPI_Comm comm, void **out)
{
    return guarded([&] {
        LAMMPS *lmp = new LAMMPS(argc, argv, comm);
        fix_styles(lmp->modify)["wall/gran/nodal"] = &FixWallNodal::create;
        *out = lmp;
    });
}

int dem_close(void *handle)
{
    return guarded([&] { delete static_cast<LAMMPS *>(handle); });
}

int dem_command(void *handle, const char *line)
{
    return guarded([&] { static_cast<LAMMPS *>(handle)->input->one(line); });
}

// Do the headers this file was compiled with describe the library that was loaded? (0x3a0: measured in LIGGGHTS 3.8.0.)
int dem_same_layout(void *handle)
{
    LAMMPS *lmp = static_cast<LAMMPS *>(handle);
    char nlocal[] = "nlocal", ntimestep[] = "ntimestep";
    return lammps_extract_global(lmp, nlocal) == static_cast<void *>(&lmp->atom->nlocal) &&
           lammps_extract_global(lmp, ntimestep) == static_cast<void *>(&lmp->update->ntimestep) &&
           sizeof(FixWallGran) == 0x3a0;
}

// Spheres of type 1 with tags 1..n; data: x (3), v (3), omega (3), radius, density of each. Call it once, on all ranks.
int dem_add_spheres(void *handle, int n, const double *data)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        Atom *atom = lmp->atom;
        for (int i = 0; i < n; i++, data += 11) {
            double x[3] = {data[0], data[1], data[2]};
            if (!lmp->domain->is_in_subdomain(x)) continue;
            atom->avec->create_atom(1, x);
            const int m = atom->nlocal - 1;
            atom->tag[m] = i + 1;
            atom->radius[m] = data[9];
            atom->density[m] = data[10];
            atom->rmass[m] = 4.0 / 3.0 * M_PI * data[9] * data[9] * data[9] * data[10];
            for (int k = 0; k < 3; k++) {
                atom->v[m][k] = data[3 + k];
                atom->omega[m][k] = data[6 + k];
                atom->f[m][k] = atom->torque[m][k] = 0.0;
            }
            for (int f = 0; f < lmp->modify->nfix; f++)
                if (lmp->modify->fix[f]->create_attribute) lmp->modify->fix[f]->set_arrays(m);
        }
        atom->natoms = n;
        atom->tag_extend();
        atom->map_init();
        atom->map_set();
    });
}

int dem_set_wall(void *handle, int dim, int nodes, int elements, const int *element, const double *x)
{
    return guarded([&] {
        FixWallNodal *wall = wall_of(static_cast<LAMMPS *>(handle));
        wall->set_elements(dim, nodes, elements, element);
        wall->start_window(x, std::vector<double>(dim * nodes, 0.0).data(), 0.0);
    });
}

// out: impulse on the nodes [N s] from this rank's particles, the number of particles, 1 if one of them is not finite.
int dem_advance(void *handle, int steps, const double *x, const double *v, double *out)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixWallNodal *wall = wall_of(lmp);
        wall->start_window(x, v, steps * lmp->update->dt);
        run_steps(lmp, steps);
        out = std::copy(wall->impulse().begin(), wall->impulse().end(), out);
        out[0] = lmp->atom->nlocal;
        out[1] = !wall->finite_particles();
    });
}

int dem_count(void *handle) { return static_cast<LAMMPS *>(handle)->atom->nlocal; }

// out: tag, x (3), v (3), omega (3), radius, mass of each particle of this rank
int dem_particles(void *handle, double *out)
{
    return guarded([&] {
        Atom *atom = static_cast<LAMMPS *>(handle)->atom;
        for (int i = 0; i < atom->nlocal; i++) {
            *out++ = atom->tag[i];
            for (double **field : {atom->x, atom->v, atom->omega}) out = std::copy(field[i], field[i] + 3, out);
            *out++ = atom->radius[i];
            *out++ = atom->rmass[i];
        }
    });
}

// Records of this rank's particles (valid until the next call), position of the nodes, force carried over from this rank.
int dem_get_state(void *handle, double **records, int *count, double *x, double *carried)
{
    return guarded([&] {
        static std::vector<double> buffer;
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        Atom *atom = lmp->atom;
        lmp->modify->pre_exchange();  // tangential springs go from the neighbour lists to the particles
        buffer.clear();
        const size_t room = 1000 + lmp->comm->maxexchange_fix + lmp->comm->maxexchange_atom;
        for (int i = 0; i < atom->nlocal; i++) {
            const size_t start = buffer.size();
            buffer.resize(start + HEAD + room);
            double *r = &buffer[start];
            r[0] = HEAD + atom->avec->pack_exchange(i, r + HEAD);
            r[1] = atom->tag[i];
            std::copy(atom->f[i], atom->f[i] + 3, r + 2);
            std::copy(atom->torque[i], atom->torque[i] + 3, r + 5);
            buffer.resize(start + size_t(r[0]));
        }
        *records = buffer.data();
        *count = int(buffer.size());
        FixWallNodal *wall = wall_of(lmp);
        const std::vector<double> now = wall->positions(), force = wall->carried_force();
        std::copy(now.begin(), now.end(), x);
        std::copy(force.begin(), force.end(), carried);
    });
}

// The counterpart: records of all particles, by tag and the same on every rank; carried is zero on all ranks but one.
int dem_set_state(void *handle, int count, double *records, const double *x, const double *carried)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixWallNodal *wall = wall_of(lmp);
        lmp->modify->pre_exchange();  // else the set-up would take the springs from the old neighbour lists
        wall->start_window(x, std::vector<double>(wall->impulse().size(), 0.0).data(), 0.0);
        unpack_particles(lmp, count, records);
        wall->set_carried_force(carried);
    });
}
}
