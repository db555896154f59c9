!! Watched functions that are on their bounds at the start of a piece: which way they go.
!!
!! A function that is nearer to its bound than it is known has no sign: the start of a motion, contacts that close or open
!! together, a body that rests with neither gap nor force. Its first derivative that is known says whether it leaves at once
!! or moves inwards; if none is known and all of its motion is rounding, it is at rest on its bound until the piece ends.
!!
!! What is known is bounded by the forward error of the whole way from state to form. A state is turned into amplitudes and a form
!! into a row of coefficients by dense matrices of eigenmodes. Each sum of these products errs by some epsilon of its terms, also
!! where the sum itself is nearly 0: a body at rest seems to move by epsilon of what the others move, and a contact at rest with
!! gap 0 seems to open and close. With the errors of the amplitudes δa = eps |V⁻¹| |z|, a derivative of the form errs by
!! Σ (|c λ^p| δa + eps |form| |mode| |λ^p a|); what is smaller than that has no sign.
module razy_exact_search_on_bound
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_amplitudes, only: amplitudes_t, rigid_of, rigid_rate_of
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_closed_form_rows, only: rows_t, value_of
   use razy_exact_search_refine, only: watched_t
   use razy_linalg_blocks, only: product
   implicit none(type, external)
   private

   public :: sort_on_bound

   !> A rate so many times its rounding takes a function out of its own rounding before it is looked at again.
   real(wp), parameter :: firmly = 1.0e3_wp

   !> Errors of what a cursor holds of a state: of terms, then rigid modes, then their rates; of dense states (their length), and of
   !> the displacements and velocities that these give (their lengths).
   type :: state_errors_t
      real(wp), allocatable :: of(:)
      real(wp) :: dense = 0.0_wp, of_dense(2) = 0.0_wp
   end type state_errors_t

   !> What is smaller than this part of the terms it is the sum of is rounding.
   real(wp), parameter :: rounding = 16*epsilon(1.0_wp)
   !> A form that is a larger part of what its terms could be is certainly no rounding.
   real(wp), parameter :: small = 1.0e-10_wp

contains

   !> Look at the functions `watched(:)`, whose values at `point` are known, before a piece of `span` s that will be looked at in
   !> steps of `step` s; `modulus` are the moduli of the amplitudes. `leaves`: the number of a function that leaves at once, or 0.
   pure subroutine sort_on_bound(rows, response, point, modulus, step, span, watched, leaves)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(inout) :: response
      type(amplitudes_t), intent(in) :: point
      real(wp), intent(in) :: modulus(:), step, span
      type(watched_t), contiguous, intent(inout) :: watched(:)
      integer, intent(out) :: leaves

      type(state_errors_t) :: errors
      real(wp) :: floor, motion, of_rate, part(response%amplitudes), size
      integer :: i, direction

      leaves = 0
      watched%idle = watched%at_rest
      if (all(watched%order > 0)) return
      motion = 0.0_wp
      do i = 1, response%amplitudes
         motion = motion + modulus(i)
      end do
      do i = 1, ubound(watched, 1)
         associate (w => watched(i))
            if (w%idle .or. w%order > 0) cycle
            ! Most functions are far too large, or will be, which this sees at once.
            size = small*(rows%longest_reach(w%form)*motion + rows%reach_constant(w%form) + w%scale)
            if (w%from_zero .and. w%g0*step > size .or. abs(w%f0) > size) cycle
            if (w%from_zero) then
               call bound_rate_floor(rows, response, point, modulus, w%form, of_rate)
               if (w%g0 > firmly*of_rate) then
                  w%f0 = max(w%f0, 0.0_wp)
                  cycle
               end if
            end if
            if (.not. allocated(errors%of)) call new_state_errors(errors, response, point, modulus)
            call parts_of_floor(errors, rows, response, modulus, w%form, part)
            floor = max(w%floor, floor_of(errors, rows, response, point, part, w%form, 0, 0.0_wp))
            if (.not. w%from_zero .and. abs(w%f0) > max(w%noise, floor)) cycle
            w%idle = response%bounded
            if (w%idle) w%idle = farthest(rows, response, point, modulus, w%form, w%bound, span) &
                                 <= floor_of(errors, rows, response, point, part, w%form, 0, span)
            if (w%idle) cycle
            part = part*response%modulus(:response%amplitudes)
            of_rate = floor_of(errors, rows, response, point, part, w%form, 1, 0.0_wp)
            if (w%g0 > firmly*of_rate) then
               w%f0 = max(w%f0, 0.0_wp)
               cycle
            end if
            w%floor = floor
            w%noise = max(w%noise, floor)
            if (w%from_zero) cycle
            direction = 0
            if (w%g0 < -of_rate) direction = -1
            if (abs(w%g0) <= of_rate) call find_way(rows, response, point, errors, part, w, direction)
            if (direction < 0 .and. leaves == 0) leaves = i
         end associate
      end do
   end subroutine sort_on_bound

   !> +1 inwards, -1 outwards, by the first derivative beyond the rate that is not rounding; 0 if there is none. `part` is the
   !> rounding that the amplitudes give to the rate.
   pure subroutine find_way(rows, response, point, errors, part, w, direction)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: point
      type(state_errors_t), intent(in) :: errors
      real(wp), intent(inout) :: part(:)
      type(watched_t), intent(in) :: w
      integer, intent(out) :: direction

      real(wp) :: derivative
      integer :: p

      direction = 0
      do p = 2, 4
         part = part*response%modulus(:response%amplitudes)
         derivative = w%side*value_of(rows, response, point, w%form, p)
         if (abs(derivative) <= floor_of(errors, rows, response, point, part, w%form, p, 0.0_wp)) cycle
         direction = nint(sign(1.0_wp, derivative))
         return
      end do
   end subroutine find_way

   !> Errors of the state at `point`, where `modulus` are the moduli of the amplitudes.
   pure subroutine new_state_errors(self, response, point, modulus)
      type(state_errors_t), intent(out) :: self
      type(response_t), intent(inout) :: response
      type(amplitudes_t), intent(in) :: point
      real(wp), intent(in) :: modulus(:)

      real(wp), dimension(2*response%m) :: moved, state
      integer :: k

      if (.not. allocated(response%from_size)) call measure_sizes(response)
      associate (m => response%m, n => response%amplitudes, one => response%one, r => response%rigid)
         allocate (self%of(response%terms + 2*r))
         call product(2*m, n + 1 + 2*r, response%from_size, [modulus(:n), abs(point%x(one:one + 2*r))], state)
         moved = 0.0_wp
         do k = 1, size(response%dense)
            call response%dense(k)%add_state(point%dense(response%first(k):response%first(k + 1) - 1), moved)
         end do
         self%of_dense = rounding*[norm2(moved(:m)), norm2(moved(m + 1:))]
         if (response%nx > 0) self%dense = rounding*norm2(point%dense(:response%nx))
         ! Terms are formed from the whole of the state.
         call product(size(self%of), 2*m, response%to_size, state + abs(moved), self%of)
         self%of = rounding*self%of
      end associate
   end subroutine new_state_errors

   !> Moduli of the modes and of the rows that give amplitudes.
   pure subroutine measure_sizes(response)
      type(response_t), intent(inout) :: response

      associate (f => response%filled, n => response%amplitudes, one => response%one, r => response%rigid, s => response%terms, &
                 from => response%from, into => response%into)
         allocate (response%from_size(2*response%m, n + 1 + 2*r), response%to_size(s + 2*r, 2*response%m))
         response%from_size(:, :n) = hypot(from(:, :n), from(:, f + 1:f + n))
         response%from_size(:, n + 1:) = abs(from(:, one:one + 2*r))
         response%to_size(:s, :) = hypot(into(:s, :), into(s + 1:2*s, :))
         response%to_size(s + 1:, :) = abs(into(2*s + 1:, :))
      end associate
   end subroutine measure_sizes

   !> At least the rounding in the rate of form `j`, at less cost than that itself: |V⁻¹| |z| is at most the product of the lengths
   !> of a row and of z.
   pure subroutine bound_rate_floor(rows, response, point, modulus, j, most)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: point
      real(wp), intent(in) :: modulus(:)
      integer, intent(in) :: j
      real(wp), intent(out) :: most

      real(wp) :: y, v
      integer :: k

      most = sqrt(huge(1.0_wp))
      if (response%nx > 0) return
      y = response%from_length(1, 0)
      v = response%from_length(2, 0)
      do k = 1, response%amplitudes
         y = y + response%from_length(1, k)*modulus(k)
         v = v + response%from_length(2, k)*modulus(k)
      end do
      do k = 1, response%rigid
         y = y + abs(rigid_of(point, response, k))
         v = v + abs(rigid_rate_of(point, response, k))
      end do
      most = 0.0_wp
      do k = 1, response%terms
         most = most + response%modulus(k)*(rows%reach(k, j)*modulus(k) &
                                            + rows%moduli(k, 0, j)*(response%to_length(1, k)*y + response%to_length(2, k)*v))
      end do
      do k = response%terms + 1, response%amplitudes
         most = most + response%modulus(k)*rows%reach(k, j)*modulus(k)
      end do
      if (response%driven%count > 0) most = most + rows%forced_reach(1, j)
      do k = 1, response%rigid
         most = most + abs(rows%rigid_y(k, j))*v + rows%length(1, j)*abs(rigid_rate_of(point, response, k)) &
                + rows%length(2, j)*abs(response%rigid_force(k))
      end do
      most = rounding*most
   end subroutine bound_rate_floor

   !> Rounding that each amplitude gives to the value of form `j` (amplitudes); times the exponents' moduli, to its next derivative.
   pure subroutine parts_of_floor(self, rows, response, modulus, j, part)
      type(state_errors_t), intent(in) :: self
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      real(wp), intent(in) :: modulus(:)
      integer, intent(in) :: j
      real(wp), intent(out) :: part(:)

      integer :: k

      do k = 1, response%amplitudes
         part(k) = rounding*rows%reach(k, j)*modulus(k)
      end do
      do k = 1, response%terms
         part(k) = part(k) + rows%moduli(k, 0, j)*self%of(k)
      end do
   end subroutine parts_of_floor

   !> Rounding in the derivative of order p (0…4) of form `j`, `later` s after `point`, if no amplitude grows until then. `part`
   !> is what the amplitudes give to it.
   pure function floor_of(self, rows, response, point, part, j, p, later) result(floor)
      type(state_errors_t), intent(in) :: self
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: point
      real(wp), intent(in) :: part(:), later
      integer, intent(in) :: j, p
      real(wp) :: floor

      real(wp) :: rate
      integer :: k

      floor = sum(part)
      if (p == 0) floor = floor + rounding*(rows%reach_constant(j) + abs(rows%constant(j)))
      if (response%driven%count > 0) floor = floor + rounding*rows%forced_reach(p, j)
      associate (length => rows%length(:, j))
         do k = 1, response%rigid
            associate (y => abs(rows%rigid_y(k, j)), v => abs(rows%rigid_v(k, j)), force => abs(response%rigid_force(k)), &
                       error => self%of(response%terms + k), of_rate => self%of(response%terms + response%rigid + k))
               rate = abs(rigid_rate_of(point, response, k)) + later*force
               if (p == 0) floor = floor + y*(error + later*of_rate) + v*of_rate &
                                   + rounding*(length(1)*(abs(rigid_of(point, response, k)) + later*rate) + length(2)*rate)
               if (p == 1) floor = floor + y*of_rate + rounding*(length(1)*rate + length(2)*force)
               if (p == 2) floor = floor + rounding*length(1)*force
            end associate
         end do
      end associate
      if (response%nx == 0) return
      floor = floor + norm2(rows%dense(:, p, j))*self%dense
      if (p == 0) floor = floor + dot_product(rows%length(:, j), self%of_dense)
   end function floor_of

   !> A bound of how far form `j` comes from `bound` until `later` s after `point`, if nothing grows and no part is dense.
   pure function farthest(rows, response, point, modulus, j, bound, later) result(most)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(in) :: response
      type(amplitudes_t), intent(in) :: point
      real(wp), intent(in) :: modulus(:), bound, later
      integer, intent(in) :: j
      real(wp) :: most

      real(wp) :: rest(0:2)
      integer :: k

      ! Rigid modes are one motion, whose parts cancel where it does not stretch the form.
      rest = [rows%constant(j) - bound, 0.0_wp, 0.0_wp]
      do k = 1, response%rigid
         associate (y => rows%rigid_y(k, j), v => rows%rigid_v(k, j), rate => rigid_rate_of(point, response, k), &
                    force => response%rigid_force(k))
            rest = rest + [y*rigid_of(point, response, k) + v*rate, y*rate + v*force, y*force]
         end associate
      end do
      most = abs(rest(0)) + later*(abs(rest(1)) + 0.5_wp*later*abs(rest(2)))
      do k = 1, response%amplitudes
         most = most + rows%moduli(k, 0, j)*modulus(k)
      end do
   end function farthest

end module razy_exact_search_on_bound
