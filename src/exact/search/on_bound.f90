!! Watched functions that are on their bounds at the start of a piece: which way they go.
!!
!! A function that is nearer to its bound than it is known has no sign: the start of a motion, contacts that close or open
!! together, a body that rests with neither gap nor force. Its first derivative that is known says whether it leaves at once
!! or moves inwards; if none is known and all of its motion is rounding, it is at rest on its bound until the piece ends.
module razy_exact_search_on_bound
   use razy_core_kinds, only: wp
   use razy_exact_closed_form_cursor, only: cursor_t
   use razy_exact_closed_form_forms, only: value_of
   use razy_exact_search_refine, only: watched_t
   use razy_exact_closed_form_response, only: response_t
   use razy_exact_search_forward_error, only: bound_rate_floor, farthest, floor_of, new_state_errors, parts_of_floor, small, &
                                              state_errors_t
   use razy_exact_closed_form_rows, only: rows_t
   implicit none(type, external)
   private

   public :: sort_on_bound

   !> A rate so many times its rounding takes a function out of its own rounding before it is looked at again.
   real(wp), parameter :: firmly = 1.0e3_wp

contains

   !> Look at the functions `watched(:)`, whose values at `point` are known, before a piece of `span` s that will be looked at in
   !> steps of `step` s; `modulus` are the moduli of the amplitudes. `leaves`: the number of a function that leaves at once, or 0.
   pure subroutine sort_on_bound(rows, response, point, modulus, step, span, watched, leaves)
      type(rows_t), intent(in) :: rows
      type(response_t), intent(inout) :: response
      type(cursor_t), intent(in) :: point
      real(wp), intent(in) :: modulus(:), step, span
      type(watched_t), intent(inout) :: watched(:)
      integer, intent(out) :: leaves

      type(state_errors_t) :: errors
      real(wp) :: floor, motion, of_rate, part(response%amplitudes), size
      integer :: i, direction
      logical :: rests, still

      leaves = 0
      watched%idle = watched%at_rest
      if (all(watched%order > 0)) return
      motion = 0.0_wp
      do i = 1, response%amplitudes
         motion = motion + modulus(i)
      end do
      still = response%bounded
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
            if (.not. allocated(errors%term)) call new_state_errors(errors, response, point, modulus)
            call parts_of_floor(errors, rows, response, modulus, w%form, part)
            floor = max(w%floor, floor_of(errors, rows, response, point, part, w%form, 0, 0.0_wp))
            if (.not. w%from_zero .and. abs(w%f0) > max(w%noise, floor)) cycle
            rests = still .and. .not. w%from_zero
            if (rests) rests = farthest(rows, response, point, modulus, w%form, w%bound, span) &
                               <= floor_of(errors, rows, response, point, part, w%form, 0, span)
            w%idle = rests
            if (rests) cycle
            part = part*response%modulus
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
      type(cursor_t), intent(in) :: point
      type(state_errors_t), intent(in) :: errors
      real(wp), intent(inout) :: part(:)
      type(watched_t), intent(in) :: w
      integer, intent(out) :: direction

      real(wp) :: derivative
      integer :: p

      direction = 0
      do p = 2, 4
         part = part*response%modulus
         derivative = w%side*value_of(rows, response, point, w%form, p)
         if (abs(derivative) <= floor_of(errors, rows, response, point, part, w%form, p, 0.0_wp)) cycle
         direction = nint(sign(1.0_wp, derivative))
         return
      end do
   end subroutine find_way

end module razy_exact_search_on_bound
