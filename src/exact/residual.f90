!! Whether the closed form of a mode solves the machine's own equations, as these were assembled.
!!
!! Over a short time τ, by Gauss's rule of three points (order 6), with y from the closed form and q = Tᵀ y its displacements,
!!
!!     q(τ) - q(0) = ∫ q' dt,
!!     rᵀ M (q'(τ) - q'(0)) = rᵀ ∫ (f - B q' - K q - Σ_j w_j F_j) dt,   w_cᵀ q' + e_c' = 0 for what is held,
!!
!! where r has a component along every coordinate of the machine. Loads act as far as they move what is followed. Nothing of how
!! the closed form was made is used: coupled coordinates, modes, response and constraints are all under test, and so is whether
!! what was summed up gives a motion back that is much smaller than its terms. Where modes of turning shafts are left out that no
!! contact feels, only displacements along the contacts can be tested.
module razy_exact_residual
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, move_to, reserve, set_state, state_of
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_constrained_motion, only: constrained_motion_t
   use razy_hybrid_linear_form, only: linear_form_t
   use razy_hybrid_mode, only: mode_t
   use razy_hybrid_system, only: system_t
   implicit none(type, external)
   private

   public :: is_whole, new_probe, probe_t, worst_residual

   !> Above, a closed form is not called a solution.
   real(wp), parameter :: worst_residual = 1.0e-10_wp
   !> τ turns the fastest term by this angle, at which the rule errs by 3e-14, and straight lines of excitation change by no more.
   real(wp), parameter :: angle = 0.1_wp
   !> Nodes and weights on (0, 1).
   real(wp), parameter :: node(3) = 0.5_wp + [-0.5_wp, 0.0_wp, 0.5_wp]*sqrt(0.6_wp), weight(3) = [5.0_wp, 8.0_wp, 5.0_wp]/18

   !> rᵀM, rᵀB and rᵀK on the coupled coordinates (m each), and rᵀw (contacts).
   type :: probe_t
      real(wp), allocatable, private :: mass(:), damping(:), stiffness(:), contact(:)
   contains
      procedure :: residual
   end type probe_t

   !> What is missing in displacements (m) and in momentum, the sizes of their terms, and what is missing in what is held, over its
   !> size.
   type :: balance_t
      real(wp), allocatable :: displacement(:)
      real(wp) :: momentum = 0.0_wp, moves = 0.0_wp, terms = 0.0_wp, held = 0.0_wp
   end type balance_t

contains

   !> The projections of a system's machine that are tested, once for all of its modes.
   subroutine new_probe(self, system)
      type(probe_t), intent(out) :: self
      type(system_t), intent(in) :: system

      real(wp) :: r(size(system%machine%mass, 1))
      integer :: i, j

      associate (machine => system%machine, project => system%coupled%project)
         r = [(cos(1.7_wp*i*i)/sqrt(machine%mass(i, i)), i=1, size(r))]
         self%mass = matmul(project, matmul(r, machine%mass))
         self%damping = matmul(project, matmul(r, machine%damping))
         self%stiffness = matmul(project, matmul(r, machine%stiffness))
         self%contact = [(dot_product(r, machine%contact(j)%w), j=1, size(machine%contact))]
      end associate
   end subroutine new_probe

   !> The largest of the residuals, each over the size of its terms. The state is of the size that loads give it in `t_end`, s, at
   !> most; `force` holds the forces of all contacts on the state where there are constraints.
   function residual(self, system, mode, response, constrained, force, t_end)
      class(probe_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(response_t), intent(in) :: response
      type(constrained_motion_t), intent(in) :: constrained
      type(linear_form_t), intent(in) :: force(:)
      real(wp), intent(in) :: t_end
      real(wp) :: residual

      type(balance_t) :: found
      real(wp) :: load, moves, tau
      integer :: i

      tau = min(t_end, angle/maxval([response%fastest, response%slope, tiny(1.0_wp)]))
      load = norm2(system%load) + sum(norm2(abs(system%harmonic), dim=1))
      ! No mode is moved by less than what moves the fastest; what is followed step by step has no length of its own.
      moves = max(sum(response%from_length(1, [0, (i, i=response%terms + 1, response%terms + response%tones)])), &
                  (tau/angle)**2*load)
      moves = min(moves, 0.5_wp*t_end**2*load)
      if (.not. moves > 0.0_wp) moves = 1.0_wp
      found = balance(self, system, mode, response, constrained, force, tau, moves)
      residual = found%held
      if (is_whole(response)) then
         residual = max(residual, maxval([0.0_wp, abs(found%displacement)])/found%moves, abs(found%momentum)/found%terms)
      else
         residual = maxval([residual, (abs(dot_product(system%w(:, i), found%displacement))/(found%moves*norm2(system%w(:, i))), &
                                       i=1, size(system%w, 2))])
      end if
   end function residual

   !> Whether no mode was left out that nothing feels.
   pure logical function is_whole(response)
      type(response_t), intent(in) :: response

      integer :: i

      associate (turning => abs(response%turn(:response%terms)) > 0.0_wp)
         is_whole = size(turning) + count(turning) + 2*response%rigid &
                    + sum([(response%dense(i)%states, i=1, size(response%dense))]) == 2*response%m
      end associate
   end function is_whole

   !> The balance over `tau`, s, from displacements of the size `moves`, and velocities of that in a turn of the fastest term.
   function balance(self, system, mode, response, constrained, force, tau, moves) result(found)
      class(probe_t), intent(in) :: self
      type(system_t), intent(in) :: system
      type(mode_t), intent(in) :: mode
      type(response_t), intent(in) :: response
      type(constrained_motion_t), intent(in) :: constrained
      type(linear_form_t), intent(in) :: force(:)
      real(wp), intent(in) :: tau, moves
      type(balance_t) :: found

      type(amplitudes_t) :: now, start
      type(linear_form_t) :: by_law(size(self%contact))
      complex(wp) :: phasor(size(system%omega))
      real(wp), dimension(2*system%m) :: x, z_start, z
      real(wp) :: path(system%m), push, size_of_push
      integer :: g, i

      call reserve(start, response)
      call reserve(now, response)
      phasor = [(exp(cmplx(0.0_wp, real(i, wp), wp)), i=1, size(phasor))]
      do i = 1, size(by_law)
         associate (piece => system%machine%contact(i)%law%branch(mode%branch(i)))
            by_law(i) = system%contact_form(i, piece%stiffness, piece%damping, piece%offset)
         end associate
      end do
      path = 0.0_wp
      push = 0.0_wp
      size_of_push = 0.0_wp
      associate (m => system%m)
         do i = 1, m
            x(i) = moves*cos(1.3_wp*i*i)
            x(m + i) = moves*response%fastest*cos(2.3_wp*i*i)
         end do
         call constrained%hold(x, rates_of_held(system, constrained, 0.0_wp*x, phasor))
         call set_state(start, response, x, phasor)
         call state_at(start, z_start)
         do g = 1, size(node)
            call move_to(start, response, node(g)*tau, now)
            call state_at(now, z)
            path = path + weight(g)*tau*z(m + 1:)
            call add_forces(weight(g)*tau, system%machine%tone%moved(phasor, node(g)*tau))
         end do
         call move_to(start, response, tau, now)
         call state_at(now, z)
         found%displacement = z(:m) - z_start(:m) - path
         found%moves = moves + maxval([0.0_wp, abs(z(:m))])
         found%momentum = dot_product(self%mass, z(m + 1:) - z_start(m + 1:)) - push
         found%terms = dot_product(abs(self%mass), abs(z(m + 1:)) + abs(z_start(m + 1:))) + size_of_push + tiny(1.0_wp)
         associate (e => system%machine%tone%moved(phasor, tau))
            if (constrained%n > 0) then
               found%held = maxval(abs(rates_of_held(system, constrained, z, e))) &
                            /max(maxval(abs(z(m + 1:)))*maxval(norm2(system%w, dim=1)), tiny(1.0_wp))
            end if
         end associate
      end associate

   contains

      subroutine state_at(at, z)
         type(amplitudes_t), intent(in) :: at
         real(wp), intent(out) :: z(:)

         call state_of(at, response, z)
         if (constrained%n > 0) z = constrained%to_state(z)
      end subroutine state_at

      !> Add the impulse of all forces at z in the time `dt`, s.
      subroutine add_forces(dt, e)
         real(wp), intent(in) :: dt
         complex(wp), intent(in) :: e(:)

         real(wp) :: acts
         integer :: j, k

         associate (m => system%m)
            acts = dot_product(self%mass, system%load) - dot_product(self%damping, z(m + 1:)) - dot_product(self%stiffness, z(:m))
            size_of_push = size_of_push + dt*(dot_product(abs(self%mass), abs(system%load)) &
                                              + dot_product(abs(self%damping), abs(z(m + 1:))) &
                                              + dot_product(abs(self%stiffness), abs(z(:m))))
            do k = 1, size(e)
               associate (harmonic => dot_product(self%mass, real(system%harmonic(:, k)*e(k))))
                  acts = acts + harmonic
                  size_of_push = size_of_push + dt*abs(harmonic)
               end associate
            end do
         end associate
         do j = 1, size(self%contact)
            associate (of_contact => self%contact(j)*contact_force(j, e))
               acts = acts - of_contact
               size_of_push = size_of_push + dt*abs(of_contact)
            end associate
         end do
         push = push + dt*acts
      end subroutine add_forces

      !> F of contact j: by its law, or, where friction and constraints act, as the solution has it.
      real(wp) function contact_force(j, e)
         integer, intent(in) :: j
         complex(wp), intent(in) :: e(:)

         associate (law => system%machine%contact(j)%law)
            if (law%of_normal .or. law%branch(mode%branch(j))%constraint) then
               contact_force = force(j)%value(z, e)
            else
               contact_force = by_law(j)%value(z, e)
            end if
         end associate
      end function contact_force

   end function balance

   !> s' of what is held (n), at z and the phasors e; at z = 0 that of drives and errors.
   pure function rates_of_held(system, constrained, z, e) result(rate)
      type(system_t), intent(in) :: system
      type(constrained_motion_t), intent(in) :: constrained
      real(wp), intent(in) :: z(:)
      complex(wp), intent(in) :: e(:)
      real(wp) :: rate(constrained%n)

      type(linear_form_t) :: form
      integer :: i

      do i = 1, constrained%n
         form = system%contact_form(constrained%contact(i), 0.0_wp, 1.0_wp, 0.0_wp)
         rate(i) = form%value(z, e)
      end do
   end function rates_of_held

end module razy_exact_residual
