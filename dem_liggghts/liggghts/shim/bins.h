// The fix neighbor/bins: before each neighbour list it sizes LIGGGHTS' bins for the box as it is then.
//
// LIGGGHTS makes them half a contact wide, however few particles are in the box and however far one of them has flown:
// 200 spheres in a hall are 1e8 bins, and one that flies away ends the run with "Too many neighbor bins".
#pragma once
#include <mpi.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "atom.h"
#include "domain.h"
#include "fix.h"
#include "modify.h"
#include "neighbor.h"

using namespace LAMMPS_NS;

class FixBins : public Fix {
public:
    FixBins(LAMMPS *lmp, int argc, char **argv) : Fix(lmp, argc, argv) {}
    static Fix *create(LAMMPS *lmp, int argc, char **argv) { return new FixBins(lmp, argc, argv); }

    int setmask() override { return FixConst::PRE_EXCHANGE; }
    void setup_pre_exchange() override { pre_exchange(); }

    void pre_exchange() override
    {
        double low[3], high[3];
        box(low, high);
        double size = 0.5 * neighbor->cutneighmax;  // LIGGGHTS' own choice
        if (!(size > 0) || !std::isfinite(high[0] - low[0] + high[1] - low[1] + high[2] - low[2])) return;
        const double most = LEAST + PER_PARTICLE * double(atom->natoms), margin = 2 * reach();
        auto bins = [&](int k) { return (high[k] - low[k] + margin) / size + 4; };
        while (bins(0) * bins(1) * bins(2) > most) size *= 1.25;
        char word[] = "binsize", number[32];
        std::snprintf(number, sizeof number, "%.17g", size);
        char *words[] = {word, number};
        neighbor->modify_params(2, words);
        not_much_thinner_than(size, low, high);
    }

private:
    static constexpr double LEAST = 1e5, PER_PARTICLE = 20, THIN = 50;

    void box(double *low, double *high) const  // of all particles, and at least what it was made with
    {
        double far[6] = {-domain->minxlo, -domain->minylo, -domain->minzlo, domain->minxhi, domain->minyhi, domain->minzhi};
        for (int i = 0; i < atom->nlocal; i++)
            for (int k = 0; k < 3; k++) {
                far[k] = std::max(far[k], -atom->x[i][k]);
                far[3 + k] = std::max(far[3 + k], atom->x[i][k]);
            }
        double all[6];
        MPI_Allreduce(far, all, 6, MPI_DOUBLE, MPI_MAX, world);
        for (int k = 0; k < 3; k++) low[k] = -all[k], high[k] = all[3 + k];
    }

    double reach() const  // how far around the box bins are needed
    {
        double most = neighbor->cutneighmax;
        for (int f = 0; f < modify->nfix; f++) most = std::max(most, modify->fix[f]->extend_cut_ghost() + neighbor->skin);
        return most;
    }

    void not_much_thinner_than(double size, const double *low, const double *high)  // which LIGGGHTS refuses
    {
        double *least[3] = {&domain->minxlo, &domain->minylo, &domain->minzlo};
        double *most[3] = {&domain->minxhi, &domain->minyhi, &domain->minzhi};
        for (int k = 0; k < 3; k++) {
            const double lacking = size / THIN - (high[k] - low[k]);
            if (lacking <= 0) continue;
            *least[k] = std::min(*least[k], low[k]) - lacking;
            *most[k] = std::max(*most[k], high[k]) + lacking;
        }
    }
};
