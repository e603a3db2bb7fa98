// The contact law of contact/law.py where it differs from LIGGGHTS': two contact models that stand on LIGGGHTS' own, and
// what it takes to make them known to it, as `model hertz/damped` and `tangential coulomb`.
#pragma once
#include <algorithm>
#include <cmath>

#include "fix_insert_stream.h"  // which granular_styles.h needs and does not include
#include "global_properties.h"
#include "granular_styles.h"

namespace LIGGGHTS {
namespace ContactModels {

static const int HERTZ_DAMPED = 60, TANGENTIAL_COULOMB = 60;  // numbers of models, below 64; LIGGGHTS' are small

inline MatrixProperty *minus_damping_ratio(PropertyRegistry &registry, const char *caller, bool)
{
    MatrixProperty *table = MODEL_PARAMS::createPerTypePairProperty(registry, "dampingRatio", caller);
    for (int i = 0; i < table->rows; i++)
        for (int j = 0; j < table->cols; j++) table->data[i][j] *= -1;
    return table;
}

inline MatrixProperty *attraction(PropertyRegistry &registry, const char *caller, bool)
{
    return MODEL_PARAMS::createPerTypePairProperty(registry, "attraction", caller);
}

// Hertz's law whose damping ratio is given instead of computed from the restitution, and whose force is zero where the
// damper would pull, unless the two materials have attraction.
template <> class NormalModel<HERTZ_DAMPED> : public NormalModel<HERTZ> {
public:
    NormalModel(LAMMPS *lmp, IContactHistorySetup *history, ContactModelBase *model)
        : NormalModel<HERTZ>(lmp, history, model)
    {
    }

    void connectToProperties(PropertyRegistry &registry)
    {
        const char *caller = "model hertz/damped";
        registry.registerProperty("Yeff", &MODEL_PARAMS::createYeff);
        registry.registerProperty("Geff", &MODEL_PARAMS::createGeff);
        registry.registerProperty("betaeff", &minus_damping_ratio);
        registry.registerProperty("attraction", &attraction);
        registry.connect("Yeff", Yeff, caller);
        registry.connect("Geff", Geff, caller);
        registry.connect("betaeff", betaeff, caller);
        registry.connect("attraction", attraction_, caller);
    }

    void surfacesIntersect(SurfacesIntersectData &contact, ForceData &on_i, ForceData &on_j)
    {
        NormalModel<HERTZ>::surfacesIntersect(contact, on_i, on_j);
        if (!(contact.Fn < 0) || attraction_[contact.itype][contact.jtype] != 0) return;  // NaN goes on
        on_i.reset();  // the normal model comes first: nothing else is in there
        on_j.reset();
        contact.Fn = 0;
    }

private:
    double **attraction_ = nullptr;
};

// LIGGGHTS' spring with history, with Coulomb's limit on spring and damper together.
template <> class TangentialModel<TANGENTIAL_COULOMB> : public TangentialModel<TANGENTIAL_HISTORY> {
public:
    TangentialModel(LAMMPS *lmp, IContactHistorySetup *history, ContactModelBase *model)
        : TangentialModel<TANGENTIAL_HISTORY>(lmp, history, model)
    {
    }

    void connectToProperties(PropertyRegistry &registry)
    {
        TangentialModel<TANGENTIAL_HISTORY>::connectToProperties(registry);
        registry.connect("coeffFrict", friction_, "tangential_model coulomb");
    }

    void surfacesIntersect(const SurfacesIntersectData &contact, ForceData &on_i, ForceData &on_j)
    {
        ForceData i, j;
        SurfacesIntersectData pushed = contact;  // LIGGGHTS takes the size of a pull for a normal force
        pushed.Fn = std::max(contact.Fn, 0.0);
        TangentialModel<TANGENTIAL_HISTORY>::surfacesIntersect(pushed, i, j);
        const double limit = friction_[contact.itype][contact.jtype] * pushed.Fn, size = vectorMag3D(i.delta_F);
        const double share = size > limit ? limit / size : 1.0;
        for (int k = 0; k < 3; k++) {
            on_i.delta_F[k] += share * i.delta_F[k];
            on_j.delta_F[k] += share * j.delta_F[k];
            on_i.delta_torque[k] += share * i.delta_torque[k];
            on_j.delta_torque[k] += share * j.delta_torque[k];
        }
    }

private:
    double **friction_ = nullptr;
};

template <class Style> struct Registered {
    static PairStyles::IGranularPairStyle *pair(LAMMPS *lmp, PairGran *parent, int64_t hash)
    {
        return new PairStyles::Granular<ContactModel<Style>>(lmp, parent, hash);
    }
    static Walls::IGranularWall *wall(LAMMPS *lmp, FixWallGran *parent, int64_t hash)
    {
        return new Walls::Granular<ContactModel<Style>>(lmp, parent, hash);
    }
    static void add()
    {
        PairStyles::Factory::instance().addStyle("gran", int(Style::HASHCODE), &pair);
        Walls::Factory::instance().addStyle("gran", int(Style::HASHCODE), &wall);
    }
};

// Once per process: LIGGGHTS keeps its tables from instance to instance.
inline void register_models()
{
    static bool done = false;
    if (done) return;
    done = true;
    Factory::instance().addNormalModel("hertz/damped", HERTZ_DAMPED);
    Factory::instance().addTangentialModel("coulomb", TANGENTIAL_COULOMB);
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_OFF, COHESION_OFF>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_OFF, COHESION_SJKR>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_OFF>>::add();
    Registered<GranStyle<HERTZ_DAMPED, TANGENTIAL_COULOMB, COHESION_SJKR>>::add();
}

}  // namespace ContactModels
}  // namespace LIGGGHTS
