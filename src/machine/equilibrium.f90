!! Static equilibrium under the constant loads, contacts included.
!!
!! The potential energy ½ qᵀKq + Σ U_j(s_j) - f0ᵀq of a machine whose contacts push harder the deeper they are is convex; where
!! springs soften it has several minima, of which the one that is met first counts. It
!! is minimised by Newton's method in the contact state at hand with an exact line search, the sign change of the slope along the
!! direction. With piecewise-linear laws the energy is piecewise quadratic, and all ends after finitely many steps. Rigid-body
!! displacements are left out: of all equilibria the one that is orthogonal (in M) to the modes of zero stiffness is taken.
!! Excitation does not count, nor do circulatory forces, the skew part of K.
!! Constraints (rigid stops, friction) have no energy; machines with such are not for this module. Nor is there an
!! equilibrium where a body would have to rest on the edge of a law whose force jumps there.
module razy_machine_equilibrium
   use razy_core_kinds, only: wp
   use razy_linalg_bracketed_root, only: bracketed_root_t
   use razy_linalg_dense, only: add_outer, lower_inverse, symmetric_part
   use razy_linalg_generalised, only: dense_modes, eigenpairs_t, modes_found
   use razy_linalg_lapack, only: dpotrf
   use razy_machine_machine, only: contact_t, is_ring, machine_t, stretch_of
   implicit none(type, external)
   private

   public :: find_equilibrium

   integer, parameter :: most_iterations = 200
   !> Stiffness below this part of the largest, pivots below this part of their diagonal entries, and residuals below this part of
   !> the loads are rounding.
   real(wp), parameter :: negligible = 1.0e-11_wp
   !> A minimum further than this along a direction, in steps of Newton's method or of the residual, is none.
   real(wp), parameter :: farthest = 1.0e30_wp

contains

   !> Equilibrium displacement `q` (n). `found` is false if the loads do work on a free rigid-body motion: coordinate `at` moves
   !> most in it, and `rest`, N (N m), is the force there that would balance them; 0 if that is not known.
   subroutine find_equilibrium(machine, q, found, at, rest)
      type(machine_t), intent(in) :: machine
      real(wp), intent(out) :: q(:)
      logical, intent(out) :: found
      integer, intent(out), optional :: at
      real(wp), intent(out), optional :: rest

      type(eigenpairs_t) :: modes
      real(wp) :: direction(size(q)), step
      real(wp), allocatable :: elastic(:, :)
      integer :: i
      logical :: linear, near

      if (present(at)) at = 1
      if (present(rest)) rest = 0.0_wp
      ! Circulatory forces have no potential.
      elastic = symmetric_part(machine%stiffness)
      q = 0.0_wp
      found = .false.
      near = .false.
      linear = all([(is_linear(machine%contact(i)), i=1, size(machine%contact))])
      do i = 1, most_iterations
         modes = directions_of(tangent_stiffness(machine, elastic, q), machine%mass)
         if (modes%status /= modes_found) return
         direction = newton_direction(machine, elastic, modes, q)
         found = norm2(direction) <= 0.0_wp
         if (found) return
         call line_search(machine, elastic, q, direction, step)
         ! A direction that is but rounding may seem to have no end.
         found = near
         if (present(rest) .and. step > 0.1_wp*huge(1.0_wp)) call find_rest(machine, elastic, modes, q, at, rest)
         if (step > 0.1_wp*huge(1.0_wp)) return
         q = q + step*direction
         ! Without a full step of the linear case, one more than is needed.
         found = near .or. (linear .and. abs(step - 1.0_wp) <= 1.0e-9_wp)
         near = settled(machine, elastic, modes, q)
         found = found .and. near
         if (found) return
      end do
   end subroutine find_equilibrium

   !> Directions (n, n) along which `stiffness` (n, n) is diagonal, and its values there: the columns of L⁻ᵀ for K = L Lᵀ, at a
   !> fraction of the cost of the eigenvectors, which serve where a motion may be free.
   function directions_of(stiffness, mass) result(pairs)
      real(wp), contiguous, intent(in) :: stiffness(:, :), mass(:, :)
      type(eigenpairs_t) :: pairs

      real(wp), allocatable :: factor(:, :)
      logical :: definite
      integer :: i, info, n

      n = size(mass, 1)
      factor = stiffness
      call dpotrf("L", n, factor, n, info)
      definite = info == 0
      if (definite) definite = all([(factor(i, i)**2 > negligible*stiffness(i, i), i=1, n)])
      if (.not. definite) then
         pairs = dense_modes(stiffness, mass)
         return
      end if
      allocate (pairs%value(n), source=1.0_wp)
      pairs%vector = transpose(lower_inverse(factor))
   end function directions_of

   !> The free motion on which the loads do most work.
   pure subroutine find_rest(machine, elastic, modes, q, at, rest)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:)
      type(eigenpairs_t), intent(in) :: modes
      integer, intent(inout) :: at
      real(wp), intent(inout) :: rest

      real(wp) :: work(size(q))
      integer :: i

      work = matmul(machine%load - restoring(machine, elastic, q), modes%vector)
      i = maxloc(abs(work), dim=1, mask=abs(modes%value) <= negligible*maxval(abs(modes%value)))
      if (i == 0) return
      at = maxloc(abs(modes%vector(:, i)), dim=1)
      rest = work(i)/modes%vector(at, i)
   end subroutine find_rest

   !> Whether what is left of the residual is rounding, in the norm sqrt(rᵀ K⁻¹ r), or with eigenvectors sqrt(rᵀ M⁻¹ r).
   pure function settled(machine, elastic, modes, q)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:)
      type(eigenpairs_t), intent(in) :: modes
      logical :: settled

      settled = norm2(matmul(restoring(machine, elastic, q) - machine%load, modes%vector)) &
                <= negligible*(norm2(matmul(machine%load, modes%vector)) &
                               + norm2(matmul(restoring(machine, elastic, q, .true.), abs(modes%vector))))
   end function settled

   !> K q + Σ w F(s), N (N m); with `moduli` the sum of the moduli of all terms.
   pure function restoring(machine, elastic, q, moduli) result(force)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:)
      logical, intent(in), optional :: moduli
      real(wp) :: force(size(q))

      real(wp) :: damping, f, s, stiffness, w(size(q))
      integer :: branch, j

      force = matmul(elastic, q)
      if (present(moduli)) force = matmul(abs(elastic), abs(q))
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            call stretch_of(contact, q, s, w)
            branch = contact%law%initial_branch(s, 0.0_wp)
            f = contact%law%force(branch, s, 0.0_wp, contact%normal)
            if (present(moduli)) then
               call contact%law%slopes(branch, s, 0.0_wp, contact%normal, stiffness, damping)
               force = force + abs(w)*(abs(stiffness*s) + abs(f - stiffness*s))
            else
               force = force + w*f
            end if
         end associate
      end do
   end function restoring

   !> K with the contacts as they are at `q` (n, n).
   pure function tangent_stiffness(machine, elastic, q) result(k)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:)
      real(wp), allocatable :: k(:, :)

      real(wp) :: damping, s, stiffness, turned(size(q)), w(size(q))
      integer :: branch, j

      k = elastic
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j))
            call stretch_of(contact, q, s, w, turned)
            branch = contact%law%initial_branch(s, 0.0_wp)
            call contact%law%slopes(branch, s, 0.0_wp, contact%normal, stiffness, damping)
            call add_outer(k, stiffness, w)
            ! The force in a ring turns with the place.
            if (is_ring(contact)) call add_outer(k, contact%law%force(branch, s, 0.0_wp, contact%normal)/max(s, tiny(s)), turned)
         end associate
      end do
   end function tangent_stiffness

   !> Newton's direction at `q` with the modes there; along those without stiffness down the residual, if there is any.
   pure function newton_direction(machine, elastic, modes, q) result(direction)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:)
      type(eigenpairs_t), intent(in) :: modes
      real(wp) :: direction(size(q))

      real(wp) :: part(size(q))
      integer :: i

      part = matmul(restoring(machine, elastic, q) - machine%load, modes%vector)
      where (abs(part) <= negligible*(norm2(matmul(machine%load, modes%vector)) + tiny(1.0_wp))) part = 0.0_wp
      associate (value => modes%value, free => abs(modes%value) <= negligible*maxval(abs(modes%value)))
         if (any(free .and. abs(part) > 0.0_wp)) then
            part = merge(-part, 0.0_wp, free)
         else
            where (free)
               part = 0.0_wp
            else where
               part = -part/abs(value)
            end where
         end if
      end associate
      ! From a maximum it goes down, with the displacement that is largest upwards.
      i = minloc(modes%value, dim=1)
      if (norm2(part) <= 0.0_wp .and. modes%value(i) < -negligible*maxval(abs(modes%value))) then
         part(i) = sign(1.0_wp, modes%vector(maxloc(abs(modes%vector(:, i)), dim=1), i))
      end if
      direction = matmul(modes%vector, part)
   end function newton_direction

   !> The step along `direction` at which the energy is least, where its slope changes its sign; huge if it falls without end.
   !> From one edge of a contact to the next, then by wide steps, until the slope is positive; if it does not grow any more, and all
   !> laws are piecewise linear, it never will be.
   subroutine line_search(machine, elastic, q, direction, step)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: elastic(:, :), q(:), direction(:)
      real(wp), intent(out) :: step

      type(bracketed_root_t) :: root
      real(wp) :: edge(most_edges(machine), size(machine%contact)), high, low, slope_high, slope_low, terms
      integer :: j
      logical :: beyond, linear

      linear = all([(is_linear(machine%contact(j)), j=1, size(machine%contact))])
      edge = edges(machine, q, direction)
      step = 0.0_wp
      low = 0.0_wp
      slope_low = slope(low)
      if (.not. abs(slope_low) > 0.0_wp) then
         low = min(1.0_wp, minval(edge, mask=edge > 0.0_wp))
         do while (.not. slope(low) < 0.0_wp .and. low > tiny(low))
            low = 0.5_wp*low
         end do
         slope_low = slope(low)
      end if
      do while (slope_low < 0.0_wp)
         step = huge(1.0_wp)
         beyond = .not. any(edge > low)
         high = merge(max(1.0_wp, 4*low), minval(edge, mask=edge > low), beyond)
         if (high > farthest) return
         slope_high = slope(high)
         if (slope_high >= 0.0_wp) exit
         terms = dot_product(abs(direction), restoring(machine, elastic, q + high*direction, .true.) + abs(machine%load))
         if (beyond .and. linear .and. slope_high <= slope_low + negligible*terms) return
         low = high
         slope_low = slope_high
      end do
      if (slope_low >= 0.0_wp) return
      call root%start(low, slope_low, high, slope_high)
      do while (.not. root%done())
         call root%take(slope(root%trial))
      end do
      step = root%best

   contains

      pure function slope(t)
         real(wp), intent(in) :: t
         real(wp) :: slope

         slope = dot_product(direction, restoring(machine, elastic, q + t*direction) - machine%load)
      end function slope

   end subroutine line_search

   !> Whether the force of a contact is a piecewise linear function of the displacements.
   pure logical function is_linear(contact)
      type(contact_t), intent(in) :: contact

      is_linear = contact%law%piecewise_linear .and. .not. allocated(contact%frame)
   end function is_linear

   !> The most branches that a contact has, twice.
   pure integer function most_edges(machine)
      type(machine_t), intent(in) :: machine

      integer :: j

      most_edges = 2*maxval([(machine%contact(j)%law%plain, j=1, size(machine%contact)), 0])
   end function most_edges

   !> The steps along `direction` at which contacts change their branch, at the bounds of s of all branches; negative for those
   !> that are not met.
   pure function edges(machine, q, direction) result(edge)
      type(machine_t), intent(in) :: machine
      real(wp), intent(in) :: q(:), direction(:)
      real(wp) :: edge(most_edges(machine), size(machine%contact))

      real(wp) :: rate, s, turned(size(q)), w(size(q))
      integer :: b, j

      edge = -1.0_wp
      do j = 1, size(machine%contact)
         associate (contact => machine%contact(j), law => machine%contact(j)%law)
            call stretch_of(contact, q, s, w, turned)
            rate = dot_product(w, direction)
            if (allocated(contact%frame)) then
               call ring_edges(s, rate, dot_product(turned, direction), edge(:, j))
               cycle
            end if
            if (.not. (abs(rate) > 0.0_wp .and. law%slope(1, 1) > 0.0_wp)) cycle
            do b = 1, law%plain
               associate (guard => law%branch(b)%guard(1))
                  if (guard%above /= 0) edge(2*b - 1, j) = (guard%upper - s)/rate
                  if (guard%below /= 0) edge(2*b, j) = (guard%lower - s)/rate
               end associate
            end do
         end associate
      end do

   contains

      !> Of contact j in a plane: where |(s + t rate, t across)| is at a bound.
      pure subroutine ring_edges(s, rate, across, edge)
         real(wp), intent(in) :: s, rate, across
         real(wp), intent(inout) :: edge(:)

         real(wp) :: root
         integer :: b

         associate (law => machine%contact(j)%law, square => rate**2 + across**2)
            do b = 1, law%plain
               associate (guard => law%branch(b)%guard(1))
                  if (guard%above == 0 .or. .not. square > 0.0_wp) cycle
                  root = (s*rate)**2 + square*(guard%upper**2 - s**2)
                  if (root > 0.0_wp) edge(2*b - 1:2*b) = [(-s*rate + sqrt(root))/square, (-s*rate - sqrt(root))/square]
               end associate
            end do
         end associate
      end subroutine ring_edges

   end function edges

end module razy_machine_equilibrium
