// LIGGGHTS in the process of Python: the few calls that drive one instance, and its errors as return codes.
//
// Neighbour lists, migration between ranks and the motion of single spheres are LIGGGHTS' own; the contact models stand on
// its own, in models.h; the wall is in wall.h, rigid bodies are in bodies.h and their rotation in rotation.h. All arrays
// are contiguous doubles in SI units, of nodes with dim components each. Calls return 0, or 1 with the text in dem_last_error(), or 2 when a particle or a node is NaN or infinite.
#include <mpi.h>
#include <unistd.h>  // environ

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <map>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "atom_vec.h"
#include "bins.h"
#include "bodies.h"
#include "comm.h"
#include "domain.h"
#include "fix_contact_history.h"
#include "group.h"
#include "input.h"
#include "integrate.h"
#include "lammps.h"
#include "library.h"
#include "models.h"
#include "output.h"
#include "rotation.h"
#include "universe.h"
#include "wall.h"

// Same mangled names as in the library, which is loaded after this file: the first definition wins, and an error no
// longer ends the process.
static std::string last_error;

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

// Modify's table of fix styles is private; an explicit instantiation may name it all the same.
using FixStyles = std::map<std::string, Fix *(*)(LAMMPS *, int, char **)>;
template <FixStyles *Modify::*member> struct StyleTable {
    friend FixStyles &fix_styles(Modify *modify) { return *(modify->*member); }
};
FixStyles &fix_styles(Modify *modify);
template struct StyleTable<&Modify::fix_map>;

// LIGGGHTS opens a file for what it says and, told to use one, never closes it: all instances share one, closed or not.
static void say_it_nowhere(LAMMPS *lmp)
{
    static FILE *nowhere = std::fopen("/dev/null", "w");
    if (!nowhere || !lmp->screen || lmp->screen == stdout) return;  // null: on all ranks but one
    std::fclose(lmp->screen);
    lmp->screen = lmp->universe->uscreen = nowhere;
}

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

static std::vector<Vec> read_nodes(const double *flat, int dim, size_t nodes)
{
    std::vector<Vec> out(nodes);
    for (Vec &node : out) {
        node = {flat[0], flat[1], dim == 3 ? flat[2] : 0.0};
        flat += dim;
    }
    return out;
}

// Rows of numbers that tell what acts on nodes: the number of each, then dim components.
static void set_force(FixWallNodal *wall, int dim, int count, const double *flat)
{
    std::vector<int> rows(count);
    std::vector<Vec> force(count);
    for (int k = 0; k < count; k++, flat += 1 + dim) {
        rows[k] = int(flat[0]);
        force[k] = {flat[1], flat[2], dim == 3 ? flat[3] : 0.0};
    }
    wall->set_force(rows, force);
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

// Records may come in any order of ranks; afterwards every rank holds its own particles in the order of the records. With
// ``keep`` the forces are those of the records, else those of the contacts as they are now.
static void unpack_particles(LAMMPS *lmp, int count, double *records, int n_bodies, const double *body, bool keep)
{
    Atom *atom = lmp->atom;
    Bodies bodies(lmp);
    forget_particles(atom);
    atom->natoms = 0;
    for (double *r = records; r != records + count; r += int(r[0])) atom->natoms++;
    for (double *r = records; r != records + count; r += int(r[0])) atom->avec->unpack_exchange(r + HEAD);
    lmp->domain->pbc();
    lmp->domain->reset_box();
    forget_particles(atom);
    for (double *r = records; r != records + count; r += int(r[0]))
        if (lmp->domain->is_in_subdomain(r + HEAD + 1)) atom->avec->unpack_exchange(r + HEAD);
    if (bodies.any()) bodies.place(n_bodies, body);
    lmp->update->whichflag = 1;  // else the fixes are left out
    lmp->update->integrate->setup_minimal(1);
    lmp->update->whichflag = 0;
    if (bodies.any()) keep ? bodies.set_forces(n_bodies, body) : bodies.sum_forces();
    int mine = 0;
    for (double *r = records; r != records + count; r += int(r[0])) {
        if (mine == atom->nlocal || atom->tag[mine] != int(r[1])) continue;
        if (keep) std::copy(r + 2, r + 5, atom->f[mine]), std::copy(r + 5, r + HEAD, atom->torque[mine]);
        mine++;
    }
    if (mine != atom->nlocal) throw std::runtime_error("the state is not one of these particles");
}

// Neighbour lists and forces of now; springs of friction come from the particles.
static void set_up_again(LAMMPS *lmp)
{
    Bodies bodies(lmp);
    lmp->update->whichflag = 1;  // else the fixes are left out
    lmp->update->integrate->setup_minimal(1);
    lmp->update->whichflag = 0;
    if (bodies.any()) bodies.sum_forces();
}

static FixContactHistory *history_of(LAMMPS *lmp)  // of spheres with each other; none without friction
{
    return static_cast<FixContactHistory *>(lmp->modify->find_fix_style_strict("contacthistory", 0));
}

static double packed_number(int64_t value)  // a whole number as LIGGGHTS sends it among doubles: its bits
{
    double out;
    std::memcpy(&out, &value, sizeof out);
    return out;
}

// Springs as rows of numbers: tag of a particle; tag of its partner, or minus the number, from 1 on, of an element of a
// wall; displacements of the particle (6), of friction and of rolling friction.
static const int SPRING = 8;

extern "C" {
const char *dem_last_error() { return last_error.c_str(); }

unsigned dem_source() { return SHIM_SOURCE; }  // checksum of the source this was compiled from

// Is the MPI that LIGGGHTS was built with the one of this process, which runs already?
int dem_shares_mpi()
{
    int runs;
    MPI_Initialized(&runs);
    return runs;
}

// Names in the environment of this process.
static std::set<std::string> variables()
{
    std::set<std::string> names;
    for (char **entry = environ; *entry; ++entry) names.insert(std::string(*entry, strcspn(*entry, "=")));
    return names;
}

// MPI of LIGGGHTS' own. What it puts into the environment would tell the other MPI, in child processes of this
// one, of a launcher that it does not know.
static void start_own_mpi()
{
    const std::set<std::string> before = variables();
    MPI_Init(nullptr, nullptr);
    for (const std::string &name : variables())
        if (!before.count(name)) unsetenv(name.c_str());
}

// comm: where the communicator is stored; null: this rank alone, on an MPI of LIGGGHTS' own.
int dem_open(int argc, char **argv, const MPI_Comm *comm, void **out)
{
    return guarded([&] {
        if (!comm && !dem_shares_mpi()) start_own_mpi();
        LAMMPS *lmp = new LAMMPS(argc, argv, comm ? *comm : MPI_COMM_SELF);
        say_it_nowhere(lmp);
        LIGGGHTS::ContactModels::register_models();
        fix_styles(lmp->modify)["neighbor/bins"] = &FixBins::create;
        fix_styles(lmp->modify)["wall/gran/nodal"] = &FixWallNodal::create;
        fix_styles(lmp->modify)["multisphere/splitting"] = &FixMultisphereSplitting::create;
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

// Spheres with tags 1..n; data of each: x (3), v (3), omega (3), radius, mass in a contact, type, tag of its body or
// 0, way there from the body's centre of mass along its principal axes (3). Call it once, on all ranks.
int dem_add_spheres(void *handle, int n, const double *data)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        Atom *atom = lmp->atom;
        Bodies bodies(lmp);
        const int single = lmp->group->find("single");
        for (int i = 0; i < n; i++, data += 16) {
            double x[3] = {data[0], data[1], data[2]};
            if (!lmp->domain->is_in_subdomain(x)) continue;
            atom->avec->create_atom(int(data[11]), x);
            const int m = atom->nlocal - 1;
            atom->tag[m] = i + 1;
            atom->radius[m] = data[9];
            atom->rmass[m] = data[10];
            atom->density[m] = data[10] / (4.0 / 3.0 * M_PI * data[9] * data[9] * data[9]);
            for (int k = 0; k < 3; k++) {
                atom->v[m][k] = data[3 + k];
                atom->omega[m][k] = data[6 + k];
                atom->f[m][k] = atom->torque[m][k] = 0.0;
            }
            for (int f = 0; f < lmp->modify->nfix; f++)
                if (lmp->modify->fix[f]->create_attribute) lmp->modify->fix[f]->set_arrays(m);
            if (bodies.any()) bodies.join(m, data[12] > 0 ? int(data[12]) : -1, data + 13);
            if (data[12] == 0 && single >= 0) atom->mask[m] |= lmp->group->bitmask[single];
        }
        atom->natoms = n;
        atom->tag_extend();
        atom->map_init();
        atom->map_set();
    });
}

int dem_set_bodies(void *handle, int n, const double *data)  // see bodies.h; on all ranks, the same on all
{
    return guarded([&] { Bodies(static_cast<LAMMPS *>(handle)).place(n, data); });
}

int dem_count_bodies(void *handle) { return Bodies(static_cast<LAMMPS *>(handle)).count(); }

int dem_bodies(void *handle, double *out)  // of this rank, as in bodies.h
{
    return guarded([&] { Bodies(static_cast<LAMMPS *>(handle)).read(out); });
}

// Walls from the element ``own`` on, whose nodes are those from number ``first`` on: the interface, or, before it is
// given, all others. data of each element: nodes (3), type, group, depth, radius of a disc or 0, rim (3), joint (3).
// keep: springs stay where they were, as well as they can. Then dem_set_moving.
int dem_set_wall(void *handle, int dim, int nodes, int elements, int first, int own, const double *data, const double *x,
                 int keep, const int *number)
{
    return guarded([&] {
        std::vector<Element> all(elements);
        for (Element &e : all) {
            for (int k = 0; k < 3; k++) e.node[k] = int(data[k]), e.rim[k] = data[7 + k] != 0, e.joint[k] = int(data[10 + k]);
            e.type = int(data[3]), e.group = int(data[4]), e.depth = data[5], e.disc = data[6];
            data += 13;
        }
        FixWallNodal *wall = wall_of(static_cast<LAMMPS *>(handle));
        wall->set_elements(dim, first, own, all, read_nodes(x, 3, nodes), keep, number);
    });
}

// The nodes that may move, and where they are.
int dem_set_moving(void *handle, int count, const int *nodes, int dim, const double *x)
{
    return guarded([&] {
        FixWallNodal *wall = wall_of(static_cast<LAMMPS *>(handle));
        wall->moving_.assign(nodes, nodes + count);
        wall->place(read_nodes(x, dim, count), std::vector<Vec>(count));
        wall->start_window(0.0);
    });
}

// See squares.h. shape: axes (2), squares along them (2), lower corner (2), side, largest depth and disc.
int dem_set_squares(void *handle, int count, const int64_t *loose, const int64_t *start, const int *element,
                    const double *shape)
{
    return guarded([&] {
        Squares &squares = wall_of(static_cast<LAMMPS *>(handle))->squares_;
        for (int k = 0; k < 2; k++) {
            squares.axis[k] = int(shape[k]), squares.shape[k] = int(shape[2 + k]);
            squares.lower[k] = shape[4 + k];
        }
        squares.side = shape[6], squares.depth = shape[7], squares.disc = shape[8];
        squares.loose.assign(loose, loose + count);
        squares.start.assign(start, start + int64_t(squares.shape[0]) * squares.shape[1] + 1);
        squares.element.assign(element, element + squares.start.back());
    });
}

// What acts on nodes and on the LAST rows of wall.h, from this rank's particles (valid until the next call), see
// set_force: the force of the last step, or, with ``impulse``, the impulse of the window so far and at the end a row
// that begins with -1: the number of particles, 1 if one of them is not finite.
int dem_wall_rows(void *handle, int dim, int impulse, double **rows, int *count)
{
    return guarded([&] {
        static std::vector<double> buffer;
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixWallNodal *wall = wall_of(lmp);
        const std::vector<Vec> &values = impulse ? wall->impulse_ : wall->force_;
        buffer.clear();
        for (int n : impulse ? wall->hit_ : wall->loaded_) {
            buffer.insert(buffer.end(), {double(n), values[n].x, values[n].y});
            if (dim == 3) buffer.push_back(values[n].z);
        }
        if (impulse) {
            buffer.insert(buffer.end(), {-1.0, double(lmp->atom->nlocal), double(!wall->finite_particles())});
            if (dim == 3) buffer.push_back(0.0);
        }
        *rows = buffer.data();
        *count = int(buffer.size());
    });
}

int dem_set_wall_force(void *handle, int dim, int count, const double *force)  // none on all ranks but one
{
    return guarded([&] { set_force(wall_of(static_cast<LAMMPS *>(handle)), dim, count, force); });
}

// A piece of a window of ``steps``: ``count`` of them from the step ``begin`` on; x, v: of the nodes that may move at the
// start of the window.
int dem_advance(void *handle, int dim, int steps, int begin, int count, const double *x, const double *v)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixWallNodal *wall = wall_of(lmp);
        if (begin == 0) {
            wall->place(read_nodes(x, dim, wall->moving_.size()), read_nodes(v, dim, wall->moving_.size()));
            wall->start_window(steps * lmp->update->dt);
        }
        run_steps(lmp, count);
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

// Records of this rank's particles (valid until the next call).
int dem_get_state(void *handle, double **records, int *count)
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
    });
}

// Springs of this rank's particles (valid until the next call); those of two particles are told by both.
int dem_get_springs(void *handle, double **rows, int *count)
{
    return guarded([&] {
        static std::vector<double> buffer;
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixContactHistory *history = history_of(lmp);
        lmp->modify->pre_exchange();  // springs go from the neighbour lists to the particles
        buffer.clear();
        auto add = [](int tag, int partner, const double *values, int width) {
            buffer.push_back(tag), buffer.push_back(partner);
            buffer.insert(buffer.end(), values, values + width);
            buffer.insert(buffer.end(), SPRING - 2 - width, 0.0);
        };
        for (int i = 0; i < lmp->atom->nlocal; i++) {
            for (int k = 0; history && k < history->n_partner(i); k++)
                add(lmp->atom->tag[i], history->partner(i, k), history->contacthistory(i, k), history->get_dnum());
            wall_of(lmp)->each_spring(i, [&](int element, const double *values, int width) {
                add(lmp->atom->tag[i], -1 - element, values, width);
            });
        }
        *rows = buffer.data();
        *count = int(buffer.size());
    });
}

// The counterpart: all springs, the same on every rank, by tag; those of two particles twice, with opposite signs.
int dem_set_springs(void *handle, int count, const double *rows)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixContactHistory *history = history_of(lmp);
        lmp->modify->pre_exchange();  // else the set-up would take the springs from the neighbour lists of before
        std::map<int, std::vector<const double *>> of;
        for (const double *row = rows; row != rows + SPRING * count; row += SPRING) of[int(row[0])].push_back(row);
        for (int i = 0; i < lmp->atom->nlocal; i++) {
            std::vector<double> packed = {0};
            std::vector<const double *> at_walls;
            int partners = 0;
            for (const double *row : of[lmp->atom->tag[i]]) {
                if (row[1] < 0) at_walls.push_back(row);
                if (row[1] < 0 || !history) continue;
                partners++, packed.push_back(packed_number(int(row[1])));
                packed.insert(packed.end(), row + 2, row + 2 + history->get_dnum());
            }
            packed[0] = packed_number(partners);
            if (history) history->unpack_exchange(i, packed.data());
            wall_of(lmp)->set_springs(i, at_walls);
        }
        set_up_again(lmp);
    });
}

int dem_halt(void *handle)  // all velocities are zero
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        for (int i = 0; i < lmp->atom->nlocal; i++)
            for (int k = 0; k < 3; k++) lmp->atom->v[i][k] = lmp->atom->omega[i][k] = 0.0;
        Bodies(lmp).halt();
        lmp->modify->pre_exchange();  // so that the springs stay
        set_up_again(lmp);
    });
}

// The counterpart of dem_get_state: records of all particles, by tag, and all bodies, the same on every rank; x: of the
// nodes that may move; force: rows, none on all ranks but one. keep: see unpack_particles.
int dem_set_state(void *handle, int dim, int count, double *records, int n_bodies, const double *bodies,
                  const double *x, int n_force, const double *force, int keep)
{
    return guarded([&] {
        LAMMPS *lmp = static_cast<LAMMPS *>(handle);
        FixWallNodal *wall = wall_of(lmp);
        lmp->modify->pre_exchange();  // else the set-up would take the springs from the old neighbour lists
        wall->place(read_nodes(x, dim, wall->moving_.size()), std::vector<Vec>(wall->moving_.size()));
        wall->start_window(0.0);
        unpack_particles(lmp, count, records, n_bodies, bodies, keep);
        if (keep) set_force(wall, dim, n_force, force);
    });
}
}
