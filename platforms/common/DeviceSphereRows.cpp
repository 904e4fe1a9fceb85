// SPDX-License-Identifier: MIT
#include "DeviceSphereRows.h"
#include "numerics/MixtureTable.h"

using namespace OpenMM;
using namespace PSE::numerics;

namespace PSE {

namespace {

/** The length that rows of a group begin with. */
double firstCapacity(const SizeGroups& sizes, int group, const Plan& plan, const Lattice& box) {
    return std::min(ROOM * sizes.neighbours(group, plan, box) + LEAST_ROOM, MOST_ROOM);
}

void append(const Polynomial& p, std::vector<double>& all) {
    all.insert(all.end(), p.powers.rbegin(), p.powers.rend());
}

} // namespace

DeviceSphereRows::DeviceSphereRows(DevicePrograms& programs, const Plan& plan, const Lattice& box,
                                   DevicePlaces& places, DeviceSpheres& spheres,
                                   StepSummary& summary, Defines defines)
    : context(programs.context()), places(places), spheres(spheres), summary(summary),
      sumImages(plan.sumImages), geometry(programs, "pseGeometry") {
    const SizeGroups& sizes = *places.sizes();
    std::vector<double> largest;
    for (int g = 0; g < sizes.size(); g++) {
        capacities.push_back(firstCapacity(sizes, g, plan, box));
        largest.push_back(sizes.groups[g].largest);
    }
    uploadReals(groupRadii, context, largest, "pseGroupRadii");
    groupRows.initialize<mm_int4>(context, sizes.size(), "pseGroupRows");
    counts.initialize<int>(context, places.count(), "pseCounts");

    PlanConstants constants;
    defines["MIXTURE"] = "1";
    prepareTables(plan, defines, constants);
    uploadConstants(planConstants, context, constants);
    setBox(plan, box);
    compiled = programs.realSpace(defines, constants);
    findSpheres = DeviceKernel(context, compiled, "findSpheres");
    evaluatePairs = DeviceKernel(context, compiled, "evaluatePairs");
}

void DeviceSphereRows::setBox(const Plan& plan, const Lattice& box) {
    std::vector<double> values = geometryOf(context, box, plan.a);
    const double rc = plan.mixture->largestRange();
    values.insert(values.end(), {plan.mixture->rangeOfPoints(), 2 / (rc * rc)});
    for (int d = 0; d < 3; d++)
        values.push_back(plan.a / box.width(d));
    geometry.set(values);
    if (sumImages)
        numImages = uploadImages(images, context, box, plan.realCutoff, plan.a);
}

/** The wave part of pairs, and the diagonal. */
void DeviceSphereRows::prepareTables(const Plan& plan, Defines& defines, PlanConstants& constants) {
    const MixtureTable table(*plan.mixture, plan.tableError);
    interpolates = table.interpolates();
    std::vector<double> values;
    for (int m = 0; m < table.size(); m++)
        for (int n = 0; n < (interpolates ? m + 1 : table.size()); n++) {
            append(table.F(m, n), values);
            append(table.C(m, n), values);
        }
    uploadReals(tables, context, values, "pseTables");
    const std::vector<double>& radii = plan.mixture->radii();
    const int kinds = static_cast<int>(radii.size()), basis = table.size();
    const MixtureScales scaleOf(*plan.mixture);
    std::vector<double> self(kinds), scale(kinds), own(interpolates ? size_t(kinds) * basis : 0);
    forEach(context, kinds, [&](int i) {
        self[i] = table.self(radii[i]);
        scale[i] = scaleOf(radii[i]);
        if (interpolates) {
            const std::vector<double> c = table.weights(radii[i]);
            std::copy(c.begin(), c.end(), own.begin() + size_t(i) * basis);
        }
    });
    uploadReals(selves, context, self, "pseSelves");
    uploadReals(scaling, context, scale, "pseScales");
    if (interpolates) {
        uploadReals(weights, context, own, "pseRadiusWeights");
        defines["INTERPOLATED"] = "1";
    }
    constants.push_back({"BASIS", basis});
    constants.push_back({"TABLE_DEGREE", table.degree()});
}

double DeviceSphereRows::bytesPerParticle(const Plan& plan, const Lattice& box, int realSize) {
    const SizeGroups sizes(plan);
    double entries = 0;
    for (int g = 0; g < sizes.size(); g++)
        entries += sizes.groups[g].count * firstCapacity(sizes, g, plan, box);
    const double entry = (plan.sumImages ? sizeof(mm_int2) : sizeof(int)) + 2 * realSize;
    const double n = plan.mixture->particleRadii().size(), kinds = plan.mixture->radii().size();
    const int weights = std::max(plan.radiusFunctions, MixtureTable::MOST_CLASSES);
    return (entries * entry + kinds * (2 + weights) * realSize) / n;
}

/** Tell the device how long rows are. @return entries of all of them */
size_t DeviceSphereRows::placeRows() {
    std::vector<mm_int4> rows;
    size_t entries = 0;
    int first = 0;
    for (size_t g = 0; g < capacities.size(); g++) {
        const int count = places.sizes()->groups[g].count, length = static_cast<int>(capacities[g]);
        rows.push_back(mm_int4(first, count, length, 0));
        first += count;
        entries += size_t(count) * length;
    }
    groupRows.upload(rows);
    return entries;
}

void DeviceSphereRows::find() {
    const int n = places.count(), groups = places.sizes()->size();
    if (entries == 0)
        entries = placeRows();
    neighbours.reserve(context, entries, sumImages ? sizeof(mm_int2) : sizeof(int),
                       "pseNeighbours");
    pairs.reserve(context, entries, 2 * realSize(context), "psePairs");
    const auto evaluate = [&](auto&... last) {
        if (sumImages)
            evaluatePairs(n, n, groups, planConstants, groupRows, places.places(), *images,
                          spheres.radii(), spheres.kinds(), *neighbours, counts, geometry.array(),
                          tables, last...);
        else
            evaluatePairs(n, n, groups, planConstants, groupRows, places.places(), spheres.radii(),
                          spheres.kinds(), *neighbours, counts, geometry.array(), tables, last...);
    };
    if (sumImages)
        findSpheres(n, n, groups, numImages, *images, groupRows, places.places(), spheres.radii(),
                    geometry.array(), *neighbours, counts, summary.maxima());
    else
        findSpheres(n, n, groups, places.groupCells(), places.cellStarts(), groupRadii, groupRows,
                    places.places(), spheres.radii(), geometry.array(), *neighbours, counts,
                    summary.maxima());
    if (interpolates)
        evaluate(weights, *pairs);
    else
        evaluate(*pairs);
}

bool DeviceSphereRows::hadRoom() {
    const double most = summary.maximum(StepSummary::Neighbours); // over the length of its row
    if (most <= 1)
        return true;
    for (double& capacity : capacities)
        capacity = std::min(MORE_ROOM * most * capacity, MOST_ROOM);
    entries = 0; // rows are to be placed anew
    return false;
}

} // namespace PSE
