!! Derivatives of a motion across an event: the saltation matrix
!!
!!     S = R_z + (f⁺ - R_z f⁻ - R_t) h_zᵀ/(h_zᵀ f⁻ + h_t)
!!
!! for an event at the zero of a guard h(z, t), where the state jumps to R(z, t), with the fields f⁻ before and f⁺ after it
!! (Leine and Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical Systems, Springer (2004); di Bernardo, Budd,
!! Champneys and Kowalczyk, Piecewise-smooth Dynamical Systems, Springer (2008)). It is applied to tangents δz as columns: an
!! event that comes later by δt = -h_zᵀ δz/(h_zᵀ f⁻ + h_t) leads to δz⁺ = R_z (δz + f⁻ δt) + R_t δt - f⁺ δt.
!!
!! What a reset does is gathered as it happens: impulses of impacts with the sides and the friction that take part as they do;
!! at an accumulation of impacts the derivative is that of its limit, the constraint's projection (Nordmark and Piiroinen,
!! Nonlinear Dyn. 58 (2009) 85-106). Several guards left at once have no single derivative; at a grazing the denominator
!! vanishes. Both are said, in `defined`, and nothing is divided by; tangents come to the constraints of the mode that follows,
!! as they do where a body that has hardly begun to slide sticks again.
module razy_hybrid_saltation
   use razy_core_kinds, only: wp
   use razy_hybrid_constraints, only: constraints_t, new_constraints
   use razy_hybrid_dynamics, only: dynamics_t
   use razy_hybrid_guards, only: guards_t, of_force, of_press
   use razy_hybrid_system, only: system_t
   use razy_linalg_dense, only: identity
   implicit none(type, external)
   private

   public :: saltation_t

   type :: saltation_t
      !> Whether tangents are carried, and whether all events so far have a derivative.
      logical :: wanted = .false., defined = .true.
      !> R_z (2m, 2m) and R_t (2m) of the event under way.
      real(wp), allocatable, private :: by_state(:, :), by_time(:)
      !> f⁻ (2m), the tangents at the event that comes later by δt (2m, columns), and δt (columns).
      real(wp), allocatable, private :: moved(:, :), delay(:)
   contains
      procedure :: begin
      procedure :: add_impulses
      procedure :: add_projection
      procedure, nopass :: hold
      procedure :: arrive
      procedure :: leave
   end type saltation_t

   !> Of the largest that it could be, a rate of a guard below which its event is a grazing.
   real(wp), parameter :: grazing = 1.0e-8_wp

contains

   !> An event begins: no reset so far, of m coordinates.
   pure subroutine begin(self, m)
      class(saltation_t), intent(inout) :: self
      integer, intent(in) :: m

      self%by_state = identity(2*m)
      self%by_time = spread(0.0_wp, 1, 2*m)
   end subroutine begin

   !> Velocities y' jump by D λ(u), u = Dᵀ y' + ė: `effect` (m, directions) is D dλ/du, `direction` (m, directions) D, and
   !> `acceleration` (directions) ë.
   pure subroutine add_impulses(self, effect, direction, acceleration)
      class(saltation_t), intent(inout) :: self
      real(wp), intent(in) :: effect(:, :), direction(:, :), acceleration(:)

      associate (m => size(effect, 1))
         self%by_time(m + 1:) = self%by_time(m + 1:) &
                                + matmul(effect, matmul(self%by_time(m + 1:), direction) + acceleration)
         self%by_state(m + 1:, :) = self%by_state(m + 1:, :) &
                                    + matmul(effect, matmul(transpose(direction), self%by_state(m + 1:, :)))
      end associate
   end subroutine add_impulses

   !> Displacements y are moved by `effect` (m, directions) times Dᵀ y + e; `velocity` (directions) are ė.
   pure subroutine add_projection(self, effect, direction, velocity)
      class(saltation_t), intent(inout) :: self
      real(wp), intent(in) :: effect(:, :), direction(:, :), velocity(:)

      associate (m => size(effect, 1))
         self%by_time(:m) = self%by_time(:m) + matmul(effect, matmul(self%by_time(:m), direction) + velocity)
         self%by_state(:m, :) = self%by_state(:m, :) + matmul(effect, matmul(transpose(direction), self%by_state(:m, :)))
      end associate
   end subroutine add_projection

   !> The tangents (2m, columns) where a mode with constraints begins: a neighbour that is off them, as where a stop that was open
   !> without a gap closes as friction begins to slide, comes to them at once, to first order, by impacts and friction, which act in
   !> their directions.
   subroutine hold(system, dynamics, tangent)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(in) :: dynamics
      real(wp), intent(inout) :: tangent(:, :)

      type(constraints_t) :: closed
      integer :: c, i
      integer, allocatable :: rigid(:)

      associate (held => dynamics%mode%constraints, m => system%m, w => dynamics%w)
         if (held%count == 0) return
         rigid = pack(held%contact, [(system%machine%contact(held%contact(i))%law%impacts, i=1, held%count)])
         call new_constraints(closed, w, rigid, [integer ::], [integer ::], [real(wp) ::])
         do c = 1, size(tangent, 2)
            call held%displace(w, -matmul(tangent(m + 1:, c), w(:, held%contact)), tangent(m + 1:, c))
            if (closed%count > 0) call closed%displace(w, -matmul(tangent(:m, c), w(:, rigid)), tangent(:m, c))
         end do
      end associate
   end subroutine hold

   !> The event at (tau, z) in the mode before it, where the guards `hit` are left: the tangents (2m, columns) there, and by
   !> how much it comes later for each.
   subroutine arrive(self, system, dynamics, guards, hit, tau, z, tangent)
      class(saltation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      logical, intent(in) :: hit(:)
      real(wp), intent(in) :: tau, z(:), tangent(:, :)

      real(wp), dimension(guards%count) :: g, rate
      logical :: crosses, moving(guards%count)
      real(wp) :: field(2*system%m)
      integer :: c, i

      call self%begin(system%m)
      self%delay = spread(0.0_wp, 1, size(tangent, 2))
      self%moved = tangent
      ! Where friction's pressing force goes through zero the field is continuous, and the event moves nothing.
      moving = hit(:guards%count) .and. guards%entry(:guards%count)%function /= of_press
      i = findloc(moving, .true., 1)
      if (i == 0) return
      call field_of(system, dynamics, tau, z, field)
      call guards%look(system, dynamics, tau, z, g, rate)
      if (guards%entry(i)%function == of_force) rate(i) = rate_of_force(system, dynamics, guards, i, tau, z, field)
      crosses = abs(rate(i)) > grazing*largest_rate(system, guards, i, field)
      self%defined = self%defined .and. crosses .and. count(moving) == 1
      if (.not. crosses) return
      do c = 1, size(tangent, 2)
         self%delay(c) = -slope_along(system, dynamics, guards, i, tau, z, tangent(:, c))/rate(i)
         self%moved(:, c) = tangent(:, c) + field*self%delay(c)
      end do
   end subroutine arrive

   !> The largest rate that guard i could have with the field (2m) as it is.
   pure function largest_rate(system, guards, i, field) result(rate)
      type(system_t), intent(in) :: system
      type(guards_t), intent(in) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: field(:)
      real(wp) :: rate

      associate (guard => guards%entry(i), m => system%m, length => system%reach(guards%entry(i)%contact))
         rate = length*(abs(guard%alpha)*norm2(field(:m)) + abs(guard%beta)*norm2(field(m + 1:)))
      end associate
   end function largest_rate

   !> (y', y'') at (tau, z).
   subroutine field_of(system, dynamics, tau, z, field)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(out) :: field(:)

      field(:system%m) = z(system%m + 1:)
      call dynamics%accelerate(system, tau, z, field(system%m + 1:))
   end subroutine field_of

   !> Guard i, of a constraint's force, at (tau, z).
   function guard_at(system, dynamics, guards, i, tau, z) result(g)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: tau, z(:)
      real(wp) :: g

      real(wp), dimension(guards%count) :: all_of_them, rate

      call guards%look(system, dynamics, tau, z, all_of_them, rate)
      g = all_of_them(i)
   end function guard_at

   !> Its rate along the motion, by a central difference: the state moves along the parabola of the field.
   function rate_of_force(system, dynamics, guards, i, tau, z, field) result(rate)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: tau, z(:), field(:)
      real(wp) :: rate

      real(wp) :: g(2), h, there(2*system%m)
      integer :: k

      ! Ten times the time of the guards' own one-sided difference: the error is of second order.
      h = 10*guards%delta
      do k = 1, 2
         associate (step => merge(-h, h, k == 1), m => system%m)
            there(:m) = z(:m) + step*(field(:m) + 0.5_wp*step*field(m + 1:))
            there(m + 1:) = z(m + 1:) + step*field(m + 1:)
            g(k) = guard_at(system, dynamics, guards, i, tau + step, there)
         end associate
      end do
      rate = (g(2) - g(1))/(2*h)
   end function rate_of_force

   !> h_zᵀ δz of guard i. The force of a constraint is linear in the state where laws are piecewise linear, and nearly so
   !> elsewhere: a central difference.
   function slope_along(system, dynamics, guards, i, tau, z, tangent) result(slope)
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      type(guards_t), intent(inout) :: guards
      integer, intent(in) :: i
      real(wp), intent(in) :: tau, z(:), tangent(:)
      real(wp) :: slope

      real(wp), parameter :: part = 1.0e-4_wp
      real(wp) :: step

      associate (guard => guards%entry(i), m => system%m, j => guards%entry(i)%contact)
         if (guard%function /= of_force) then
            slope = guard%side*(guard%alpha*dot_product(dynamics%w(:, j), tangent(:m)) &
                                + guard%beta*dynamics%slope_of_rate(system, j, tangent))
            return
         end if
         slope = 0.0_wp
         if (.not. norm2(tangent) > 0.0_wp) return
         step = part*norm2(z)/norm2(tangent)
         if (.not. step > 0.0_wp) step = 1.0_wp/norm2(tangent)
         slope = (guard_at(system, dynamics, guards, i, tau, z + step*tangent) &
                  - guard_at(system, dynamics, guards, i, tau, z - step*tangent))/(2*step)
      end associate
   end function slope_along

   !> The tangents after the event, at (tau, z) in the mode that follows.
   subroutine leave(self, system, dynamics, tau, z, tangent)
      class(saltation_t), intent(inout) :: self
      type(system_t), intent(in) :: system
      type(dynamics_t), intent(inout) :: dynamics
      real(wp), intent(in) :: tau, z(:)
      real(wp), intent(inout) :: tangent(:, :)

      real(wp) :: field(2*system%m)
      integer :: c

      call field_of(system, dynamics, tau, z, field)
      tangent = matmul(self%by_state, self%moved)
      do c = 1, size(tangent, 2)
         tangent(:, c) = tangent(:, c) + (self%by_time - field)*self%delay(c)
      end do
      call self%hold(system, dynamics, tangent)
   end subroutine leave

end module razy_hybrid_saltation
